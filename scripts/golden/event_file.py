"""Prints the records that the tests of `event_file.rs` expect, as TensorBoard's own writer makes them.

pip install tensorboard; python scripts/golden/event_file.py
"""

import io

from tensorboard.compat.proto.event_pb2 import Event, SessionLog
from tensorboard.compat.proto.summary_pb2 import Summary
from tensorboard.summary.writer.record_writer import RecordWriter


def record(event):
    file = io.BytesIO()
    RecordWriter(file).write(event.SerializeToString())
    return file.getvalue().hex()


won = Summary.Value(tag="test_battle_won_mean", simple_value=0.25)
print(record(Event(wall_time=1.5, file_version="brain.Event:2")))
print(record(Event(wall_time=2.0, step=300, summary=Summary(value=[won]))))
print(record(Event(wall_time=3.0, step=301, session_log=SessionLog(status=SessionLog.START))))
