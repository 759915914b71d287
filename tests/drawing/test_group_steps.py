"""Rays in space meet what groups leave where nothing is left of all that the rays have met before."""

from __future__ import annotations

import numpy as np
import pytest

import scenelang as nsg
from tests.pictures import psnr_db

LEFT = {
    "beads": """
        intersect {
            sphere { scale(1.1); }
            union {
                sphere { scale(0.2); translate(-0.6, 0.2, 0.5); }
                sphere { scale(0.25); translate(0.5, 0.1, 0.6); }
            }
        }
        """,
    "hole": """
        subtract {
            sphere;
            subtract {
                sphere { scale(0.9); translate(0.25, 0.25, 0.6); }
                sphere { scale(0.16); translate(0, 0.2, 0.35); }
                sphere { scale(0.1); translate(0.3, 0.45, 0.35); }
            }
        }
        """,
    "mist": """
        intersect {
            sphere { material volumetric; }
            union {
                sphere { scale(0.4); translate(-0.6, 0.2, 0.5); }
                subtract {
                    sphere { scale(0.6); translate(0.5, 0.1, 0.3); }
                    sphere { scale(0.2); translate(0.5, 0.3, 0.6); }
                }
            }
        }
        sphere { scale(0.3); translate(-0.2, -0.3, 0.3); }
        """,
}


def scene_of(name: str) -> nsg.Scene:
    """A scene, seen from the front."""
    return nsg.loads(f"canvas(64, 48); camera(eye = [0, 1.2, 4]); {LEFT[name]}")


@pytest.mark.parametrize("name", LEFT)
def test_steps_end_where_groups_may_add(name: str) -> None:
    scene = scene_of(name)
    exact = np.asarray(nsg.render(scene, backend="reference"))
    assert psnr_db(np.asarray(nsg.render(scene)), exact) > 45
