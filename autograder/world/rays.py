"""What a lidar and a camera see: distances along rays, and a small picture."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from autograder.world.room import BOX, WALL, Room

CAR = 3
"""The kind of an edge that belongs to a car, besides WALL and BOX."""

CAMERA_WIDTH, CAMERA_HEIGHT = 64, 48
"""The pixels of the camera."""
CAMERA_ANGLE = math.radians(70)
"""The horizontal field of view in radians."""
CAMERA_ABOVE = 0.2
"""The metres between the floor and the camera."""
WALL_ABOVE = 0.6
"""The height of walls, boxes and cars in metres."""
COLOURS = {WALL: (150, 150, 150), BOX: (204, 121, 60), CAR: (0, 114, 178)}
SKY, GROUND, PLACE = (220, 235, 245), (95, 95, 95), (240, 228, 66)


def cast(x: float, y: float, angles: Any, segments: Any) -> tuple[Any, Any]:
    """Return for each ray the metres to the first line that it meets, and the number of that line.

    Args:
        x: where the rays begin, in metres.
        y: where the rays begin, in metres.
        angles: directions in radians, as an array.
        segments: lines, as an array with a row (x1, y1, x2, y2) for each.

    Returns:
        The distances (infinite where there is no line) and the rows of the lines.
    """
    to_x, to_y = np.cos(angles)[:, None], np.sin(angles)[:, None]
    along_x, along_y = segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]
    from_x, from_y = segments[:, 0] - x, segments[:, 1] - y
    # The ray (x, y) + t (to_x, to_y) meets the line (x1, y1) + s (along_x, along_y) where both equations hold.
    across = to_x * along_y - to_y * along_x
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (from_x * along_y - from_y * along_x) / across
        s = (from_x * to_y - from_y * to_x) / across
    t = np.where((t >= 0) & (s >= -1e-9) & (s <= 1 + 1e-9), t, np.inf)
    nearest = np.argmin(t, axis=1)
    return t[np.arange(len(angles)), nearest], nearest


def photograph(room: Room, x: float, y: float, heading: float, segments: Any, kinds: Any) -> Any:
    """Return what a camera sees that looks straight ahead, as an array of red, green and blue for each pixel."""
    half = math.tan(CAMERA_ANGLE / 2)
    across = half * (1 - (2 * np.arange(CAMERA_WIDTH) + 1) / CAMERA_WIDTH)
    aside = np.arctan(across)
    distances, lines = cast(x, y, heading + aside, segments)
    ahead = np.maximum(np.minimum(distances, 1e3) * np.cos(aside), 1e-3)
    focal = CAMERA_WIDTH / (2 * half)
    horizon = CAMERA_HEIGHT / 2
    rows = np.arange(CAMERA_HEIGHT)[:, None] + 0.5
    top, bottom = horizon - focal * (WALL_ABOVE - CAMERA_ABOVE) / ahead, horizon + focal * CAMERA_ABOVE / ahead
    seen = np.array([COLOURS.get(int(kind), COLOURS[WALL]) for kind in kinds[lines]])
    shade = np.clip(1.15 - 0.08 * ahead, 0.45, 1.0)[:, None]
    image = np.where(rows[..., None] < horizon, SKY, GROUND).astype(float)
    image = np.broadcast_to(image, (CAMERA_HEIGHT, CAMERA_WIDTH, 3)).copy()
    low = rows[:, 0] > horizon
    floor = focal * CAMERA_ABOVE / (rows[low] - horizon)
    floor_x = x + floor * (math.cos(heading) - across * math.sin(heading))
    floor_y = y + floor * (math.sin(heading) + across * math.cos(heading))
    image[low] = np.where(_is_place(room, floor_x, floor_y)[..., None], PLACE, image[low])
    wall = (rows >= top) & (rows <= bottom)
    return np.where(wall[..., None], seen * shade, image).astype(np.uint8)


def _is_place(room: Room, x: Any, y: Any) -> Any:
    rows, columns = room.floor.shape
    row, column = (y // room.cell).astype(int), (x // room.cell).astype(int)
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    return inside & (room.floor[np.clip(row, 0, rows - 1), np.clip(column, 0, columns - 1)] >= 0)
