#!/usr/bin/env python3
"""Times one update of the pair controllers in PyTorch and in JAX, beside `mackrl bench update`.

    python3 benchmarks/peers/compare.py --install     makes .venv beside this file and installs both from the package index
    python3 benchmarks/peers/compare.py               compares; --json FILE also writes the numbers
    python3 benchmarks/peers/compare.py --simd avx2 --simd avx512   compares on each of these instruction sets, in turn

--simd limits all three programs: mackrl by MACKRL_SIMD, PyTorch by ATEN_CPU_CAPABILITY and ONEDNN_MAX_CPU_ISA (its products
are MKL's, which chooses by itself on processors that are not Intel's), JAX by --xla_cpu_max_isa. On a machine with other
work, --clock cpu counts processor time alone: of the peers by the median update, of mackrl by the mean update.

The update is the same everywhere, on one thread and in 32-bit floats: 80 rows, 60 steps, 128 -> 64 + ReLU -> GRU 64 -> 122,
log-softmax over the available columns, the loss a weighted sum of log-probabilities of two columns a row, backward, clipping
of the gradient's norm, Adam. Each peer runs as it is fastest: PyTorch its GRU over whole episodes and JAX `lax.scan` under
`jit`, with all products that do not wait for the recurrence done at once. `mackrl` goes through the forward pass step by
step, because an actor must: what a team sees at a step depends on what it did before.

The last line says how far anybody could get: the update's matrix products alone, at the rate of one large product.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ENVIRONMENT = HERE / ".venv"
INPUTS, HIDDEN, OUTPUTS = 128, 64, 122
WARM_UP = 5
ONE_THREAD_OF_XLA = "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
LIMITS = {
    name: {
        "MACKRL_SIMD": name,
        "ATEN_CPU_CAPABILITY": name,
        "ONEDNN_MAX_CPU_ISA": onednn,
        "XLA_FLAGS": f"{ONE_THREAD_OF_XLA} --xla_cpu_max_isa={xla}",
    }
    for name, onednn, xla in [("avx2", "AVX2", "AVX2"), ("avx512", "AVX512_CORE", "AVX512")]
}
clock = time.perf_counter


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--install", action="store_true", help="install the peers first")
    parser.add_argument("--mackrl", default="target/release/mackrl", help="the program to compare with")
    parser.add_argument("--rows", type=int, default=80)
    parser.add_argument("--steps", type=int, default=60)
    parser.add_argument("--updates", type=int, default=100, help="updates in a repetition")
    parser.add_argument("--repetitions", type=int, default=3, help="rounds through all programs; the best counts")
    parser.add_argument("--simd", action="append", choices=sorted(LIMITS), help="an instruction set, for all; repeatable")
    parser.add_argument("--clock", choices=["wall", "cpu"], default="wall", help="what is counted")
    parser.add_argument("--json", metavar="FILE", help="write the numbers to FILE")
    parser.add_argument("--time", choices=sorted(PEERS), help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.time:
        global clock
        clock = {"wall": time.perf_counter, "cpu": time.process_time}[arguments.clock]
        print(json.dumps(PEERS[arguments.time](arguments.rows, arguments.steps, arguments.updates)))
        return
    if arguments.install:
        install()
    compare(arguments)


def install():
    subprocess.run([sys.executable, "-m", "venv", ENVIRONMENT], check=True)
    python = ENVIRONMENT / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "--quiet", "numpy", "jax", "torch"], check=True)


def compare(arguments):
    if not shutil.which(arguments.mackrl):
        sys.exit(f"{arguments.mackrl} is no program; `cargo build --release` makes one, --mackrl names another")
    size = ["--rows", str(arguments.rows), "--steps", str(arguments.steps), "--updates", str(arguments.updates)]
    python = ENVIRONMENT / "bin" / "python"
    commands = {"mackrl": [arguments.mackrl, "bench", "update", "--json", *size]}
    for peer in PEERS:
        commands[peer] = [str(python if python.exists() else sys.executable), __file__, "--time", peer, *size]
    # Threads that a peer starts all the same share the one core that everybody gets.
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    figure = {"wall": "min_ms", "cpu": "median_ms"}[arguments.clock]
    limits = arguments.simd or ["native"]
    results = {limit: {} for limit in limits}
    for _ in range(arguments.repetitions):
        for limit in limits:
            for name, command in commands.items():
                result = timed(name, command, arguments, {**one_thread(), **LIMITS.get(limit, {})})
                if name not in results[limit] or result[figure] < results[limit][name][figure]:
                    results[limit][name] = result
    for limit in limits:
        tell(limit, results[limit], figure)
    if arguments.json:
        Path(arguments.json).write_text(json.dumps(results if arguments.simd else results["native"], indent=2) + "\n")


def timed(name, command, arguments, environment):
    if name != "mackrl":
        command = [*command, "--clock", arguments.clock]
    result, whole_s = run(command, environment)
    if name == "mackrl" and arguments.clock == "cpu":
        few = max(1, arguments.updates // 5)
        _, few_s = run([*command[:-1], str(few)], environment)
        mean_ms = 1e3 * (whole_s - few_s) / (arguments.updates - few)
        result |= {"median_ms": mean_ms, "min_ms": mean_ms}
    return result


def run(command, environment):
    """What a command printed, and the seconds of processor time that it took."""
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE) as process:
        text = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{command[0]} failed: {process.returncode}")
    return json.loads(text), usage.ru_utime + usage.ru_stime


def tell(limit, results, figure):
    ours = results["mackrl"][figure]
    print(f"{limit:10}{'min ms':>9}{'median ms':>11}{'ratio':>8}  version")
    for name, result in results.items():
        result["ratio"] = result[figure] / ours
        version = result.get("version", result.get("simd", ""))
        print(f"{name:10}{result['min_ms']:9.2f}{result['median_ms']:11.2f}{result['ratio']:8.2f}  {version}")
    rate, work = results["pytorch"]["product_gflop_per_s"], results["mackrl"]["gflop"]
    floor = 1e3 * work / rate
    print(f"floor {floor:.1f} ms: {work:.2f} GFLOP at the {rate:.0f} GFLOP/s of a large product in PyTorch on this core; mackrl reaches {floor / ours:.0%} of that")


def one_thread():
    one = {name: "1" for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")}
    one["XLA_FLAGS"] = ONE_THREAD_OF_XLA
    one["JAX_PLATFORMS"] = "cpu"
    one["CUDA_VISIBLE_DEVICES"] = ""
    return {**os.environ, **one}


def made_up_data(rows, steps):
    """Inputs of which a third is not zero, masks that leave 70 %, and two weighted columns a row."""
    import numpy

    draw = numpy.random.default_rng(0)
    inputs = draw.random((steps, rows, INPUTS), dtype=numpy.float32)
    inputs *= numpy.arange(steps * rows * INPUTS).reshape(inputs.shape) % 3 == 0
    mask = draw.random((steps, rows, OUTPUTS)) < 0.7
    columns = 1 + numpy.arange(steps * rows).reshape(steps, rows) % (OUTPUTS - 1)
    mask[..., 0] = True
    numpy.put_along_axis(mask, columns[..., None], True, axis=-1)
    return inputs, mask, columns


def clocked(update, updates):
    for _ in range(WARM_UP):
        update()
    times_ms = []
    for _ in range(updates):
        start = clock()
        update()
        times_ms.append(1e3 * (clock() - start))
    return {"min_ms": min(times_ms), "median_ms": statistics.median(times_ms), "updates": updates}


def pytorch(rows, steps, updates):
    import torch

    torch.set_num_threads(1)
    torch.manual_seed(0)
    inputs, mask, columns = (torch.from_numpy(array) for array in made_up_data(rows, steps))
    columns = columns[..., None]
    first = torch.nn.Linear(INPUTS, HIDDEN)
    gru = torch.nn.GRU(HIDDEN, HIDDEN)
    last = torch.nn.Linear(HIDDEN, OUTPUTS)
    parameters = [*first.parameters(), *gru.parameters(), *last.parameters()]
    optimiser = torch.optim.Adam(parameters, lr=5e-4, foreach=True)

    def update():
        hidden, _ = gru(torch.relu(first(inputs)))
        log_p = torch.log_softmax(last(hidden).masked_fill(~mask, float("-inf")), dim=-1)
        loss = -0.01 * log_p[..., 0].sum() + 0.02 * log_p.gather(-1, columns).sum()
        optimiser.zero_grad()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(parameters, 10.0)
        optimiser.step()

    return {"version": torch.__version__, **clocked(update, updates), "product_gflop_per_s": product_rate(torch)}


def product_rate(torch, size=1024):
    """What one core reaches where nothing but a large matrix product is asked of it."""
    left, right = torch.randn(size, size), torch.randn(size, size)
    best_s = 1e-3 * clocked(lambda: left @ right, 50)["min_ms"]
    return 2e-9 * size**3 / best_s


def jax(rows, steps, updates):
    import jax
    import jax.numpy as jnp

    inputs, mask, columns = (jnp.asarray(array) for array in made_up_data(rows, steps))
    shapes = {
        "first": (INPUTS, HIDDEN), "first_bias": (HIDDEN,),
        "input": (HIDDEN, 3 * HIDDEN), "input_bias": (3 * HIDDEN,),
        "recurrent": (HIDDEN, 3 * HIDDEN), "recurrent_bias": (3 * HIDDEN,),
        "last": (HIDDEN, OUTPUTS), "last_bias": (OUTPUTS,),
    }
    keys = jax.random.split(jax.random.PRNGKey(0), len(shapes))
    parameters = {
        name: jax.random.uniform(key, shape, minval=-1, maxval=1) / HIDDEN**0.5
        for key, (name, shape) in zip(keys, shapes.items())
    }

    def loss(p, inputs, mask, columns):
        features = jax.nn.relu(inputs @ p["first"] + p["first_bias"])
        gates = features @ p["input"] + p["input_bias"]

        def step(hidden, gates):
            recurrent = hidden @ p["recurrent"] + p["recurrent_bias"]
            reset, keep = jnp.split(jax.nn.sigmoid(gates[:, : 2 * HIDDEN] + recurrent[:, : 2 * HIDDEN]), 2, axis=1)
            new = jnp.tanh(gates[:, 2 * HIDDEN :] + reset * recurrent[:, 2 * HIDDEN :])
            hidden = (1 - keep) * new + keep * hidden
            return hidden, hidden

        _, hidden = jax.lax.scan(step, jnp.zeros((inputs.shape[1], HIDDEN)), gates)
        logits = jnp.where(mask, hidden @ p["last"] + p["last_bias"], -jnp.inf)
        log_p = jax.nn.log_softmax(logits)
        chosen = jnp.take_along_axis(log_p, columns[..., None], axis=-1)
        return -0.01 * log_p[..., 0].sum() + 0.02 * chosen.sum()

    def adam(state, inputs, mask, columns):
        p, first, second, count = state
        gradient = jax.grad(loss)(p, inputs, mask, columns)
        norm = jnp.sqrt(sum((g**2).sum() for g in gradient.values()))
        gradient = {k: g * jnp.minimum(1, 10 / (norm + 1e-6)) for k, g in gradient.items()}
        count = count + 1
        first = {k: 0.9 * first[k] + 0.1 * g for k, g in gradient.items()}
        second = {k: 0.999 * second[k] + 0.001 * g**2 for k, g in gradient.items()}
        rate = 5e-4 * jnp.sqrt(1 - 0.999**count) / (1 - 0.9**count)
        p = {k: p[k] - rate * first[k] / (jnp.sqrt(second[k]) + 1e-8) for k in p}
        return p, first, second, count

    compiled = jax.jit(adam, donate_argnums=0)
    zeros = lambda: {k: jnp.zeros_like(v) for k, v in parameters.items()}
    state = (parameters, zeros(), zeros(), jnp.float32(0))

    def update():
        nonlocal state
        state = jax.block_until_ready(compiled(state, inputs, mask, columns))

    return {"version": jax.__version__, **clocked(update, updates)}


PEERS = {"pytorch": pytorch, "jax": jax}

if __name__ == "__main__":
    main()
