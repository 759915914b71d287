"""Hover over real pipes: what words mean and what they came to."""

from __future__ import annotations

from typing import Any

from tests.editors.client import Client


def hover(client: Client, at: dict[str, Any]) -> str:
    return str(client.request("textDocument/hover", at)["contents"]["value"])


def test_hover_tells_values_ranges_and_comments(client: Client, uri: str) -> None:
    text = hover(client, client.at(uri, "0.2 * r", 6))
    assert "let r = lib.twice(k);" in text
    assert "how large" in text
    assert "= `1`" in text
    assert "param k = 0.5 in 0..1;" in hover(client, client.at(uri, "twice(k)", 6))
    assert "A dot of some size." in hover(client, client.at(uri, "lib.dot", 5))
    assert "`0`, `1`, `2`" in hover(client, client.at(uri, "* i / n", 2))


def test_hover_tells_a_transform_s_matrix_and_a_warp_s_formula(client: Client, uri: str) -> None:
    text = hover(client, client.at(uri, "scale(0.2 * r)", 1))
    assert "scale(0.2);" in text
    assert "[ 0.2    0    0 ]" in text
    assert "p → R(0.5 |p|) p" in hover(client, client.at(uri, "twirl", 1))


def test_hover_tells_an_object_s_composed_chain(client: Client, uri: str) -> None:
    text = hover(client, client.at(uri, "square", 1))
    assert "the first of 3" in text
    assert "[   1    0  0.5 ]" in text
    assert "half a side is 0.707" in text


def test_hover_tells_what_a_model_offers_and_words_mean(client: Client, uri: str) -> None:
    client.replace(uri, 'nsg 1;\nmodel "shapes2d";\nsquare { scale(sin(TAU * 1rad)); }\n')
    text = hover(client, client.at(uri, "shapes2d", 2))
    assert "2D" in text
    assert "triangle" in text
    assert "sine" in hover(client, client.at(uri, "sin", 1))
    assert "2π" in hover(client, client.at(uri, "TAU", 1))
    assert "usual one" in hover(client, client.at(uri, "model", 1))


def test_hover_tells_the_stage_unless_a_module_hides_it(client: Client, uri: str) -> None:
    client.replace(uri, "light(power = 3);\nsmooth(k = 0.2) { sphere; torus; }\n")
    assert "point light" in hover(client, client.at(uri, "light", 1))
    assert "power" in hover(client, client.at(uri, "power", 1))
    assert "blend" in hover(client, client.at(uri, "smooth", 1))
    assert "width" in hover(client, client.at(uri, "k = 0.2", 0))
    client.replace(uri, "module light(power) { sphere; }\nlight(3);\n")
    assert "module light(power)" in hover(client, client.at(uri, "light(3)", 1))
