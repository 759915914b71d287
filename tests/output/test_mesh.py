"""Solids as meshes: closed, of the right volume and colours, wherever the camera looks."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import trimesh
from click.testing import CliRunner

import scenelang
from scenelang.cli.main import cli
from scenelang.output.mesh import _ENDS as ENDS
from scenelang.output.mesh import TriangleMesh, sheets

RED = "material diffuse { color(#d33); }"


def meshed(text: str, resolution: int = 48) -> tuple[TriangleMesh, list[str]]:
    """A mesh whose every edge has two sides, and codes of warnings."""
    found = scenelang.Diagnostics()
    mesh = scenelang.to_mesh(scenelang.loads(text), resolution=resolution, diagnostics=found)
    sides = mesh.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    ways, count = np.unique(sides, axis=0, return_counts=True)
    assert (count == 1).all()  # each way once, and the other way too
    assert np.array_equal(np.unique(ways[:, ::-1], axis=0), ways)
    return mesh, [d.code for d in found]


def volume(mesh: TriangleMesh) -> float:
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    return float((a * np.cross(b, c)).sum() / 6)


@pytest.mark.parametrize(
    ("text", "exact"),
    [
        ("sphere { scale(0.8); translate(9, 0, 0); }", 4 / 3 * np.pi * 0.8**3),  # out of sight
        ("torus { scale(1, 2, 1); rotate(30deg, axis = X); }", 2 * np.pi**2 * 0.7 * 0.09 * 2),
        ("chain { sphere {} subtract sphere { scale(0.5); } }", 4 / 3 * np.pi * 0.875),
        ("chain { sphere {} intersect sphere { translate(1, 0, 0); } }", np.pi * 5 / 12),
    ],
)
def test_volumes_are_those_of_closed_forms(text: str, exact: float) -> None:
    assert volume(meshed(text)[0]) == pytest.approx(exact, rel=0.01)


def test_an_edge_between_two_spheres_is_kept() -> None:
    mesh, _ = meshed("chain { sphere {} intersect sphere { translate(1, 0, 0); } }")
    on = np.abs(np.stack([np.linalg.norm(mesh.vertices - [x, 0, 0], axis=1) for x in (0, 1)]) - 1)
    assert on.min(0).max() < 0.01
    assert (on.max(0) < 0.004).sum() > 60  # the circle where both meet


def normals(mesh: TriangleMesh) -> tuple[np.ndarray, np.ndarray]:
    """Unit normals (T, 3) of triangles, and their areas."""
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    way = np.cross(b - a, c - a)
    area = np.linalg.norm(way, axis=1)
    return way / area[:, None].clip(1e-30), area / 2


@pytest.mark.parametrize("turn", ["{}", "{ rotate(33deg, axis = [1, 2, 3]); }"])
def test_faces_are_flat_and_where_they_are(turn: str) -> None:
    mesh, _ = meshed(f'import "std/solids" as s; s.block(2, 1, 3) {turn}', 64)
    frame = np.eye(3)
    if len(turn) > 2:  # the rotation about an axis by its cross products (Rodrigues)
        x, y, z = np.array([1, 2, 3]) / 14**0.5
        across = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        angle = np.radians(33)
        frame += np.sin(angle) * across + (1 - np.cos(angle)) * across @ across
    beyond = abs(mesh.vertices @ frame) - [1, 0.5, 1.5]
    off = np.linalg.norm(beyond.clip(0), axis=1) + beyond.max(1).clip(max=0)
    assert abs(off).max() < 2e-4
    assert abs(beyond).max(0).min() > 0.1  # the surface has all three sides
    assert ((abs(mesh.vertices @ frame) - [1, 0.5, 1.5]) > -2e-4).all(1).sum() == 8  # its corners
    way, area = normals(mesh)
    tilt = np.degrees(np.arccos(abs(way @ frame).max(1).clip(max=1)))
    assert area[tilt > 0.1].sum() < 2e-4 * area.sum()


def test_blunt_edges_are_kept() -> None:
    sides = " ".join(f"s.block(1.6, 2, 1.6) {{ rotate({a}deg, axis = Y); }}" for a in (22.5, 45, 67.5))
    mesh, _ = meshed(f'import "std/solids" as s; intersect {{ s.block(1.6, 1, 1.6); {sides} }}', 64)
    angles = np.radians(22.5) * np.arange(16)  # a prism of sixteen sides
    walls = mesh.vertices[:, [0, 2]] @ np.stack([np.cos(angles), np.sin(angles)])
    off = np.maximum(walls.max(1) - 0.8, abs(mesh.vertices[:, 1]) - 0.5)
    assert abs(off).max() < 2e-5


def test_cells_are_those_of_the_result_in_any_order() -> None:
    plain = len(meshed("sphere;", 24)[0].triangles)
    for size in (20, 200):
        big = f"box {{ scale({size}); }}"
        for text in (f"intersect {{ {big} sphere; }}", f"intersect {{ sphere; {big} }}"):
            assert len(meshed(text, 24)[0].triangles) == pytest.approx(plain, rel=0.2)


def test_points_that_meet_nothing_are_outside() -> None:
    spike = "cone { translate(0, -0.25, 0); scale(2, 1000, 2); translate(0, 500, 0); }"
    mesh, _ = meshed(f"intersect {{ {spike} box {{ scale(1, 0.05, 1); }} }} cone;", 64)
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx([3**0.5, 1.5, 3**0.5], abs=0.01)  # of the cone


def test_what_takes_too_many_cells_is_coarser(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scenelang.output.mesh.MOST_CELLS", 1 << 16)
    text = "cylinder { scale(0.2, 0.6, 0.2); translate(0.03, 0, 0); twist(70); }"
    mesh, codes = meshed(text, 64)
    assert codes == ["W0509", "W0553"]
    assert volume(mesh) == pytest.approx(np.pi * 0.5**0.5 * 0.2**2 * 0.6, rel=0.1)  # as without the twist


def test_thin_walls_touching_solids_and_noise_are_closed() -> None:
    rng = np.random.default_rng(3)
    for _ in range(4):
        parts = [
            f"{word} sphere {{ scale({s:.3f}); translate({x:.3f}, {y:.3f}, {z:.3f}); }}"
            for word, s, (x, y, z) in zip(
                ["", *rng.choice(["union", "subtract", "smooth"], 7)],
                rng.uniform(0.1, 0.6, 8),
                rng.normal(0, 0.3, (8, 3)),
                strict=True,
            )
        ]
        meshed(f"chain {{ sphere {{ scale(0.7); }} union {' '.join(parts)} }}", 20)


def test_sheets_are_cycles_over_the_faces() -> None:
    table = sheets()
    for case in range(256):
        cut = {e for e, (a, b) in enumerate(ENDS) if (case >> a ^ case >> b) & 1}
        assert set(np.flatnonzero(table.crossed[case])) == cut
        assert table.number[case] <= len(cut) / 3
    assert table.number[0b01101001] == 4  # four corners apart
    assert table.number[0b10000001] == 2


def test_colours_and_files(tmp_path: Path) -> None:
    mesh, _ = meshed(f"sphere {{ scale(0.5); {RED} }} sphere {{ scale(0.5); translate(2, 0, 0); }}", 32)
    left = mesh.vertices[:, 0] < 1
    assert abs(mesh.colours[left] - [0xDD / 255, 0.2, 0.2]).max() < 0.01
    assert mesh.colours[~left].min() > 0.99
    for suffix in (".ply", ".obj", ".glb", ".stl"):
        mesh.save(tmp_path / f"a{suffix}")
        data = io.BytesIO((tmp_path / f"a{suffix}").read_bytes())
        read = trimesh.load(data, file_type=suffix[1:], process=False, force="mesh")
        assert len(read.faces) == len(mesh.triangles)
        assert read.volume == pytest.approx(volume(mesh), rel=1e-4)
        if suffix in (".ply", ".obj"):
            assert abs(read.visual.vertex_colors[:, :3] / 255 - mesh.colours).max() < 0.005
    with pytest.raises(ValueError, match=r"not one of \.stl"):
        mesh.save(tmp_path / "a.fbx")
    tall = mesh._replace(vertices=mesh.vertices * [1, 5, 1])
    for suffix in (".ply", ".obj", ".stl"):
        data = io.BytesIO(tall.encode(suffix, "z"))
        read = trimesh.load(data, file_type=suffix[1:], process=False, force="mesh")
        assert read.extents == pytest.approx(np.ptp(tall.vertices, axis=0)[[0, 2, 1]], rel=1e-4)
        assert read.volume == pytest.approx(volume(tall), rel=1e-4)  # and nothing is mirrored
    with pytest.raises(ValueError, match=r"a \.glb is y up"):
        mesh.save(tmp_path / "b.glb", up="z")


def test_colours_that_jump_do_so_at_the_edge() -> None:
    """No triangle of some size runs between two colours, also where three meet; the surface stays closed."""
    balls = (
        "sphere { scale(0.6); material diffuse { color(#f00); } }",
        "sphere { scale(0.6); translate(0.5, 0, 0); material diffuse { color(#0f0); } }",
        "sphere { scale(0.6); translate(0.2, 0.5, 0); material diffuse { color(#00f); } }",
    )
    mesh, _ = meshed("\n".join(balls))
    plain, _ = meshed("\n".join(ball[: ball.index("material")] + "}" for ball in balls))
    assert len(mesh.vertices) > len(plain.vertices)
    assert volume(mesh) == pytest.approx(volume(plain), rel=1e-4)
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles], 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 2
    mixed = np.ptp(mesh.colours[mesh.triangles], axis=1).max(1) > 0.06
    assert mixed.any()  # the slivers
    assert area[mixed].max() < 0.01 * np.median(area)
    third = (a + b + c)[~mixed] / 3
    exact = np.array([[0, 0, 0], [0.5, 0, 0], [0.2, 0.5, 0]])
    nearest = np.linalg.norm(third[:, None] - exact, axis=2).argmin(1)
    assert (mesh.colours[mesh.triangles[~mixed, 0]].argmax(1) == nearest).mean() > 0.99


def test_media_end_where_solids_begin() -> None:
    text = "chain { sphere {} union sphere { scale(0.5); translate(1, 0, 0); material volumetric; } }"
    mesh, codes = meshed(text)
    assert codes == ["W0551"]
    exact, _ = meshed("chain { sphere {} subtract sphere { scale(0.5); translate(1, 0, 0); } }")
    assert volume(mesh) == pytest.approx(volume(exact), rel=0.01)


def test_the_command_writes_a_file_or_nothing(tmp_path: Path) -> None:
    (tmp_path / "a.nsg").write_text("sphere { scale(0.5); }")
    call = ["render", str(tmp_path / "a.nsg"), "-o"]
    result = CliRunner().invoke(cli, [*call, str(tmp_path / "a.stl"), "--resolution", "16", "-v"])
    assert result.exit_code == 0
    assert "triangles" in result.output
    (tmp_path / "mist.nsg").write_text("\nsphere { material volumetric; }")
    mist = CliRunner().invoke(cli, ["render", str(tmp_path / "mist.nsg"), "-o", str(tmp_path / "c.stl")])
    assert "error[E0552]" in mist.output
    assert "mist.nsg:2:1)" in mist.output  # where it begins
    (tmp_path / "none.nsg").write_text('import "std/solids" as s;\ns.wedge(-1);')
    none = CliRunner().invoke(cli, ["render", str(tmp_path / "none.nsg"), "-o", str(tmp_path / "c.stl")])
    assert "error[E0552]: nothing is left" in none.output  # not that it is flat
    for out, options, said in (
        ("a.svg", [], "E0551"),
        ("b.stl", ["--size", "64x64"], "--size is of pictures"),
        ("b.png", ["--resolution", "16"], "--resolution is of meshes"),
        ("b.svg", ["--up", "z"], "--up is of meshes"),
        ("b.glb", ["--up", "z"], "a .glb is y up"),
        ("no/b.stl", [], "there is no folder"),
    ):
        result = CliRunner().invoke(cli, [*call, str(tmp_path / out), *options])
        assert result.exit_code in (1, 2)
        assert said in result.output
        assert not (tmp_path / out).exists()
