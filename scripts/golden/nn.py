"""Golden values of `mackrl::nn`, from the published formulas in plain Python.

Network: x -> relu(W1 x + b1) -> GRU as PyTorch documents it (gates r, z, n) -> W2 h + b2.
Adam: Kingma and Ba 2015, algorithm 1. RMSprop: PyTorch's documentation (not centred, no momentum).
"""

import json
import math
from pathlib import Path

COMMAND = "python3 scripts/golden/nn.py"
PATH = Path(__file__).resolve().parents[2] / "crates/mackrl/tests/golden/nn.json"
INPUTS, HIDDEN, OUTPUTS, ROWS, STEPS = 5, 3, 7, 2, 4


def numbers(count, seed):
    """Made-up numbers in (-1, 1), different for every seed."""
    return [math.sin(1.7 * i + 0.9 * seed) * 0.9 for i in range(count)]


def matrix(rows, columns, seed):
    flat = numbers(rows * columns, seed)
    return [flat[r * columns : (r + 1) * columns] for r in range(rows)]


def affine(weight, bias, x):
    return [sum(w * v for w, v in zip(row, x)) + b for row, b in zip(weight, bias)]


def sigmoid(x):
    return 1 / (1 + math.exp(-x))


def gru(parameters, x, h):
    from_x = affine(parameters["gru.weight_ih"], parameters["gru.bias_ih"], x)
    from_h = affine(parameters["gru.weight_hh"], parameters["gru.bias_hh"], h)
    state = []
    for i in range(HIDDEN):
        r = sigmoid(from_x[i] + from_h[i])
        z = sigmoid(from_x[HIDDEN + i] + from_h[HIDDEN + i])
        n = math.tanh(from_x[2 * HIDDEN + i] + r * from_h[2 * HIDDEN + i])
        state.append((1 - z) * n + z * h[i])
    return state


def network():
    shapes = {
        "input.weight": (HIDDEN, INPUTS),
        "input.bias": (HIDDEN,),
        "gru.weight_ih": (3 * HIDDEN, HIDDEN),
        "gru.weight_hh": (3 * HIDDEN, HIDDEN),
        "gru.bias_ih": (3 * HIDDEN,),
        "gru.bias_hh": (3 * HIDDEN,),
        "output.weight": (OUTPUTS, HIDDEN),
        "output.bias": (OUTPUTS,),
    }
    parameters = {
        name: matrix(*shape, seed) if len(shape) == 2 else numbers(shape[0], seed)
        for seed, (name, shape) in enumerate(shapes.items())
    }
    inputs = [matrix(ROWS, INPUTS, 20 + t) for t in range(STEPS)]
    states = [[0.0] * HIDDEN for _ in range(ROWS)]
    logits, hidden = [], []
    for step in inputs:
        for row in range(ROWS):
            x = affine(parameters["input.weight"], parameters["input.bias"], step[row])
            states[row] = gru(parameters, [max(v, 0.0) for v in x], states[row])
            hidden.append(states[row])
            logits.append(affine(parameters["output.weight"], parameters["output.bias"], states[row]))
    return {
        "parameters": parameters,
        "inputs": flatten(flatten(inputs)),
        "hidden": flatten(hidden),
        "logits": flatten(logits),
    }


def flatten(rows):
    return [value for row in rows for value in row]


def optimisers():
    count, steps, rate = 5, 3, 5e-4
    start = numbers(count, 40)
    gradients = [numbers(count, 50 + t) for t in range(steps)]
    adam, m, v = list(start), [0.0] * count, [0.0] * count
    rms, square = list(start), [0.0] * count
    results = {"adam": [], "rmsprop": []}
    for t, gradient in enumerate(gradients, start=1):
        for i, g in enumerate(gradient):
            m[i] = 0.9 * m[i] + 0.1 * g
            v[i] = 0.999 * v[i] + 0.001 * g * g
            adam[i] -= rate * (m[i] / (1 - 0.9**t)) / (math.sqrt(v[i] / (1 - 0.999**t)) + 1e-8)
            square[i] = 0.99 * square[i] + 0.01 * g * g
            rms[i] -= rate * g / (math.sqrt(square[i]) + 1e-8)
        results["adam"].append(list(adam))
        results["rmsprop"].append(list(rms))
    return {"learning_rate": rate, "parameters": start, "gradients": gradients, **results}


if __name__ == "__main__":
    golden = {"command": COMMAND, "network": network(), "optimisers": optimisers()}
    PATH.write_text(json.dumps(golden, indent=1) + "\n")
