//! Frames: a header, a mask, a payload.
//!
//! Reading and writing them is tungstenite's [`FrameSocket`]'s. What it leaves to its user is here: to unmask, and to refuse what
//! the standard forbids.

use std::io::Read;

use tungstenite::{
    Error,
    protocol::frame::{
        Frame, FrameHeader, FrameSocket,
        coding::{Control, Data, OpCode},
    },
};

use super::WebsocketError;

/// Greatest length of a message in bytes. SMAC's maps, which clients send, have about 100 kB; a replay stays below 1 MB.
pub const MESSAGE_LENGTH_MAX: usize = 16 << 20;
/// Greatest length of the payload of a control frame, by the standard.
const CONTROL_LENGTH_MAX: usize = 125;

/// A message of bytes.
pub(super) const BINARY: OpCode = OpCode::Data(Data::Binary);
/// The end.
pub(super) const CLOSE: OpCode = OpCode::Control(Control::Close);
/// The answer to a ping.
pub(super) const PONG: OpCode = OpCode::Control(Control::Pong);

/// A whole message, or a control frame; clients give a `mask`, servers none.
pub(super) fn whole(opcode: OpCode, payload: &[u8], mask: Option<[u8; 4]>) -> Frame {
    let header = FrameHeader {
        is_final: true,
        opcode,
        mask,
        ..FrameHeader::default()
    };
    Frame::from_payload(header, payload.to_vec().into())
}

/// Reads one frame: what it is, whether it ends its message, and its payload, unmasked. `is_masked` says whether the peer has to
/// mask, as clients do; `room` is the greatest payload of a frame that is no control frame.
pub(super) fn read(
    socket: &mut FrameSocket<impl Read>,
    is_masked: bool,
    room: usize,
) -> Result<(OpCode, bool, Vec<u8>), WebsocketError> {
    let read = socket.read(Some(room.max(CONTROL_LENGTH_MAX)));
    let frame = read.map_err(in_words)?.ok_or(WebsocketError::Closed)?;
    let header = frame.header().clone();
    if header.rsv1 || header.rsv2 || header.rsv3 {
        return Err(WebsocketError::protocol("reserved bits are set"));
    }
    if header.mask.is_some() != is_masked {
        let expected = if is_masked { "masked" } else { "unmasked" };
        return Err(WebsocketError::protocol(format!(
            "expected a {expected} frame"
        )));
    }
    let is_control = matches!(header.opcode, OpCode::Control(_));
    if is_control && !header.is_final {
        return Err(WebsocketError::protocol("a control frame in parts"));
    }
    let room = if is_control { CONTROL_LENGTH_MAX } else { room };
    let mut payload = Vec::from(frame.into_payload());
    if payload.len() > room {
        return Err(WebsocketError::protocol(format!(
            "a frame of {} bytes, expected at most {room}",
            payload.len()
        )));
    }
    let mask = header.mask.unwrap_or_default();
    for (byte, mask) in payload.iter_mut().zip(mask.into_iter().cycle()) {
        *byte ^= mask;
    }
    Ok((header.opcode, header.is_final, payload))
}

/// What went wrong with a frame.
pub(super) fn in_words(error: Error) -> WebsocketError {
    match error {
        Error::Io(error) => error.into(),
        Error::ConnectionClosed | Error::AlreadyClosed => WebsocketError::Closed,
        other => WebsocketError::protocol(other.to_string()),
    }
}
