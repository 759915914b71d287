"""The reading renderer against a loop over pixels, reads and objects in float64."""

from __future__ import annotations

import numpy as np
import torch

from scenelang.drawing.neural.paper import Reading, ReadingConfig

Array = np.ndarray


def sigmoid(x: Array) -> Array:
    return 1 / (1 + np.exp(-x))


def gru(
    x: np.ndarray, h: np.ndarray, wi: np.ndarray, wh: np.ndarray, bi: np.ndarray, bh: np.ndarray
) -> np.ndarray:
    """Cho et al. 2014 with a reset of the recurrent part, gates in the order reset, keep, candidate."""
    n = len(h)
    a, b = wi @ x + bi, wh @ h + bh
    reset, keep = sigmoid(a[:n] + b[:n]), sigmoid(a[n : 2 * n] + b[n : 2 * n])
    candidate = np.tanh(a[2 * n :] + reset * b[2 * n :])
    return (1 - keep) * candidate + keep * h


def test_it_reads_as_the_paper_says() -> None:
    torch.manual_seed(5)
    config = ReadingConfig(vector=6, hidden=5, reads=3, octaves=2)
    network = Reading(config).double()
    with torch.no_grad():
        network.start.normal_()
    vectors, tokens = torch.randn(2, 3, 6).double(), torch.randint(0, 4, (2, 3))
    points, count = torch.randn(2, 4, 2).double(), torch.tensor([3, 2])
    with torch.no_grad():
        found = network(vectors, tokens, points, count).numpy()
    weights = {k: v.detach().numpy() for k, v in network.state_dict().items()}
    for b in range(2):
        for p in range(4):
            x, y = points[b, p].tolist()
            angles = [np.pi * x, 2 * np.pi * x, np.pi * y, 2 * np.pi * y]
            place = np.array([x, y, *np.sin(angles), *np.cos(angles)])
            state = weights["start"]
            for _ in range(3):
                answers = []
                for i in range(int(count[b])):
                    seen = np.concatenate([vectors[b, i].numpy(), np.eye(4)[int(tokens[b, i])], [i / 4]])
                    both = np.concatenate([place, seen])
                    matrix = np.concatenate([weights["look_place.weight"], weights["look_object.weight"]], 1)
                    bias = weights["look_place.bias"]
                    answers.append(
                        gru(
                            both,
                            state,
                            matrix,
                            weights["look_state.weight"],
                            bias,
                            weights["look_state.bias"],
                        )
                    )
                pooled = np.max(answers, 0)
                state = gru(
                    pooled,
                    state,
                    weights["next.weight_ih"],
                    weights["next.weight_hh"],
                    weights["next.bias_ih"],
                    weights["next.bias_hh"],
                )
            expected = weights["head.weight"] @ state + weights["head.bias"]
            np.testing.assert_allclose(found[b, p], expected, atol=1e-12)


def test_a_union_of_equal_places_ignores_order() -> None:
    """Pooling forgets the order; only the token and the place in the stream tell it."""
    torch.manual_seed(1)
    network = Reading(ReadingConfig(vector=6, hidden=8, reads=2, octaves=2))
    with torch.no_grad():
        network.look_object.weight[:, -1] = 0.0  # blind to the place in the stream
        vectors, points = torch.randn(1, 3, 6), torch.randn(1, 5, 2)
        tokens = torch.zeros(1, 3, dtype=torch.int64)
        first, second = network(vectors, tokens, points), network(vectors[:, [2, 0, 1]], tokens, points)
    torch.testing.assert_close(first, second)
