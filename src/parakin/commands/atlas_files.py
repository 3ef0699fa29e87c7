"""The files of ``parakin atlas``: a picture for each map, one table of them all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..export.figure_file import PICTURES

if TYPE_CHECKING:
    from ..performance.atlas import Atlas, PerformanceMap
    from ..workspaces.certified.region import Region


@dataclass(frozen=True)
class AtlasFiles:
    """The files to write: all of them into a folder, or the one that the path's ending names.

    name : the machine's; maps : how many
    """

    name: str
    path: Path
    maps: int

    def __post_init__(self) -> None:
        if self.path.suffix.lower() in PICTURES and self.maps > 1:
            raise InputError(f'"{self.path}": several slices are several pictures, name a folder', "--output")
        if self.path.suffix and self.path.suffix.lower() not in (*PICTURES, ".csv") and not self.path.is_dir():
            raise InputError(
                f'"{self.path}": expected a folder, or a file that ends in .png, .pdf, .svg or .csv', "--output"
            )

    def write(self, atlas: Atlas, maps: Sequence[PerformanceMap]) -> dict[str, str]:
        """Write the maps' pictures and their table; returns the paths."""
        from ..export.atlas_maps import make_map_csv, render_map
        from ..export.files import Content, write_files

        kind = "" if self.path.is_dir() else self.path.suffix.lower()
        contents: dict[str, Content] = {}
        names: dict[str, str] = {}
        if kind != ".csv":
            for number, drawn in enumerate(maps):
                key = "map" if self.maps == 1 else f"map {number + 1}"
                position = _format_slice_position(drawn.region, atlas.map.region)
                names[key] = self.path.name if kind else f"{self.name}.atlas{position}.png"
                contents[names[key]] = render_map(drawn, atlas.isotropic_on(drawn), kind or ".png")
        if kind not in PICTURES:
            names["table"] = self.path.name if kind else f"{self.name}.atlas.csv"
            contents[names["table"]] = make_map_csv(maps)
        folder = self.path.parent if kind else self.path
        write_files(folder, contents)
        return {key: str(folder / name) for key, name in names.items()}


def _format_slice_position(cut: Region, region: Region) -> str:
    """Format where a slice cuts a region, for its file's name."""
    fixed = cut.fixed_axes
    return "".join(f".{axis}{fixed[axis]:g}" for axis in region.free_axes if axis in fixed)
