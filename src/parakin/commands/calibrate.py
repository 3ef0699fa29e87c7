"""``parakin calibrate``: the numbers of a machine from measurements, or a plan of what to measure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter

from ..errors import InputError, PoseError
from ..export.figure_file import PICTURES
from ..export.number_format import format_fixed
from ..units import ANGLE, LENGTH, QuantityError, QuantityKind, name_display_unit, parse_quantity, to_display
from .console import announce_compiling, format_table, print_json, print_text
from .options import Json, Name, OutputPath, Sizes, load_machine, require_ending, tell_options

if TYPE_CHECKING:
    from ..arrays import Array
    from ..calibration.calibration import Calibration
    from ..calibration.measurement_plan import MeasurementPlan
    from ..calibration.measurements import Measurements, MeasuringSetup, Noise
    from ..export.files import Content
    from ..machine import Machine

_LENGTHS = "distance", "height"  # columns besides the axes
_LENGTH_DIGITS, _ANGLE_DIGITS = 4, 5
_MOST_NAMED = 8


def calibrate(
    name: Name,
    measured: Path | None = None,
    /,
    *,
    free: Annotated[list[str] | None, Parameter(negative="")] = None,
    noise: str | None = None,
    angle_noise: str | None = None,
    encoders: str | None = None,
    angle_encoders: str | None = None,
    centre: Annotated[str | None, Parameter(allow_leading_hyphen=True)] = None,
    frame: Literal["machine", "instrument"] = "machine",
    pinned: bool = False,
    plain: bool = False,
    plan: int | None = None,
    measure: str | None = None,
    output: OutputPath = None,
    picture: Path | None = None,
    json: Json = False,
    sizes: Sizes = None,
) -> int:
    """The numbers of a machine that explain measurements best, or a plan of what to measure.

    Parameters
    ----------
    name
        A shipped machine's name or a YAML file.
    measured
        A CSV file with a header: the joints, and what was measured there: all axes of the pose, some of X, Y, Z, the
        tip's distance from a point (distance), its height over a plane (height); mm and degrees, or a unit: X [in].
    free
        A number that may change: its name, a pattern such as legs.*.foot.z, or a group (feet, platform, rods, rails,
        encoders, mounting, head, table). May be given again; by default all that measurements of poses tell.
    noise
        The standard deviation of a measured length; by default 10um.
    angle_noise
        That of a measured angle; by default 0.001deg.
    encoders
        That of what a drive that slides says; by default 0um.
    angle_encoders
        That of what a drive that turns says; by default 0deg.
    centre
        The point of the distances, X,Y,Z in mm; by default it is found with the rest.
    frame
        Whose frame X, Y, Z are in: the machine's, or an instrument's (laser tracker), which is found with the rest.
    pinned
        The tip was held in one place while the tool turned about it; the place is found with the rest.
    plain
        Plain least squares; by default outliers pull no harder than three standard deviations do.
    plan
        Choose so many poses to measure, inside all limits, instead; -o writes them as CSV.
    measure
        What a plan will measure: "X Y Z" or "Z"; by default all axes.
    output
        A machine file to write, .yaml; of a plan a table, .csv.
    picture
        A picture of the residuals to write: .png, or .pdf or .svg for a printed page.
    """
    machine = load_machine(name, sizes)
    _check_outputs(plan, output, picture)
    stated = _parse_noise(noise, angle_noise, encoders, angle_encoders)
    if plan is not None:
        if measured is not None:
            raise InputError("a plan needs no measurements", "--plan")
        return _plan(machine, plan, free, measure, stated, output, json)
    path = _require_file(measured, measure)
    rows = read_measurements(machine, path, parse_setup(centre, frame, pinned), stated)
    _show(_calibrate(machine, rows, path, free, plain), output, picture, json)
    return 0


def _require_file(measured: Path | None, measure: str | None) -> Path:
    if measured is None:
        raise InputError("a CSV file of measurements expected, or --plan", "calibrate")
    if measure is not None:
        raise InputError("goes with --plan; the columns of a file of measurements tell what was measured", "--measure")
    return measured


def _calibrate(machine: Machine, rows: Measurements, path: Path, free: list[str] | None, plain: bool) -> Calibration:
    announce_compiling()
    from ..calibration.calibration import calibrate as calibrate_machine

    try:
        return calibrate_machine(machine, rows, free, "linear" if plain else "soft_l1")
    except PoseError as error:
        if error.argument == "free":
            raise
        raise InputError(str(error), str(path)) from None


def _show(calibration: Calibration, output: Path | None, picture: Path | None, json: bool) -> None:
    """Write the files of a calibration, and print it."""
    from ..export.calibration import format_calibrated_yaml, render_residuals

    contents: dict[str, tuple[Path, Content]] = {}
    if output is not None:
        contents["machine"] = output, format_calibrated_yaml(calibration)
    if picture is not None:
        contents["picture"] = picture, render_residuals(calibration, picture.suffix.lower())
    files = _write(contents)
    if json:
        from ..export.json.calibration import encode_calibration

        print_json(encode_calibration(calibration, files))
    else:
        print_text("\n".join([_format_calibration(calibration), *(f"{kind}  {path}" for kind, path in files.items())]))


def _check_outputs(plan: int | None, output: Path | None, picture: Path | None) -> None:
    require_ending(output, (".yaml" if plan is None else ".csv",))
    if picture is not None and plan is not None:
        raise InputError("a plan has none", "--picture")
    require_ending(picture, PICTURES, "--picture")


def _write(contents: dict[str, tuple[Path, Content]]) -> dict[str, str]:
    from ..export.files import write_files

    files = {}
    for kind, (path, content) in contents.items():
        write_files(path.parent, {path.name: content})
        files[kind] = str(path)
    return files


def _parse_noise(length: str | None, angle: str | None, slide: str | None, turn: str | None) -> Noise:
    from ..calibration.measurements import Noise, check_noise

    def parse(text: str, option: str, kind: QuantityKind) -> float:
        try:
            return parse_quantity(text, kind)
        except QuantityError as error:
            raise InputError(str(error), option) from None

    result = Noise()
    for field, text, option, kind in (
        ("length", length, "--noise", LENGTH),
        ("angle", angle or "0.001deg", "--angle-noise", ANGLE),
        ("slide", slide, "--encoders", LENGTH),
        ("turn", turn, "--angle-encoders", ANGLE),
    ):
        if text is not None:
            result = replace(result, **{field: parse(text, option, kind)})
            try:
                check_noise(result)
            except PoseError as error:
                raise InputError(str(error), option) from None
    return result


def parse_setup(centre: str | None, frame: Literal["machine", "instrument"], pinned: bool) -> MeasuringSetup:
    """Parse what is known of where things were measured."""
    from ..calibration.measurements import MeasuringSetup
    from .values import parse_row

    point = None if centre is None else parse_row(centre.split(","), ("X", "Y", "Z"), ("mm",) * 3, None, "--centre")
    return MeasuringSetup(frame, point, pinned)


def read_measurements(machine: Machine, path: Path, setup: MeasuringSetup, noise: Noise) -> Measurements:
    """Read a file of measurements; its header tells what was measured.

    Raises :class:`InputError` with file and line.
    """
    from ..calibration.measurements import make_measurements
    from .rows import open_table, read_rows

    try:
        with open_table(path) as file:
            header = file.readline()
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", str(path)) from error
    except UnicodeDecodeError:
        raise InputError("not a text file in UTF-8", str(path)) from None
    words = [cell.partition("[")[0].strip().strip('"').lower() for cell in header.split(",")]
    axes = [axis for axis in machine.axes if axis.lower() in words]
    lengths = [name for name in _LENGTHS if name in words]
    if not (axes or lengths or setup.pinned):
        wanted = f"{', '.join((*machine.joints, *machine.axes))} (or {' or '.join(_LENGTHS)})"
        raise InputError(f"its header names nothing measured, expected {wanted}", str(path), 1)
    if "distance" not in lengths and setup.centre is not None:
        raise InputError("goes with a column distance", "--centre")
    units = [unit for axis, unit in zip(machine.axes, machine.axis_units, strict=True) if axis in axes]
    names = [*machine.joints, *axes, *lengths]
    values, _ = read_rows(path, names, [*machine.joint_units, *units, *["mm"] * len(lengths)])
    columns = {name: values[:, [names.index(name)]] for name in lengths}
    count = len(machine.joints)
    try:
        return make_measurements(
            machine,
            values[:, :count],
            values[:, count : count + len(axes)] if axes else None,
            " ".join(axes) or None,
            columns.get("distance"),
            columns.get("height"),
            setup,
            noise,
        )
    except PoseError as error:
        raise InputError(str(error), str(path)) from None


def _plan(
    machine: Machine,
    count: int,
    free: list[str] | None,
    measure: str | None,
    noise: Noise,
    output: Path | None,
    json: bool,
) -> int:
    announce_compiling()
    from ..calibration.measurement_plan import plan_measurements
    from ..export.tables.poses import PoseTable, format_pose_csv

    with tell_options(count="--plan", axes="--measure"):
        result = plan_measurements(machine, count, free, measure, noise)
    table = format_pose_csv(PoseTable(machine, result.poses, result.joints, [""] * len(result.poses)))
    files = {} if output is None else _write({"plan": (output, table)})
    if json:
        from ..export.json.calibration import encode_plan

        print_json(encode_plan(result, files))
    elif output is None:
        print_text(table.rstrip("\n"))
    else:
        print_text("\n".join([_format_plan(result), *(f"{kind}  {path}" for kind, path in files.items())]))
    return 0


def _format_plan(plan: MeasurementPlan) -> str:
    return (
        f"{plan.machine.name}: {len(plan.poses)} poses to measure {' '.join(plan.axes)}; the tool's error after the "
        f"calibration, root mean square: {1e3 * plan.error:.3g} um"
    )


def _format_place(place: Array) -> str:
    return ", ".join(format_fixed(x, _LENGTH_DIGITS) for x in place.tolist()) + " mm"


def _format_calibration(calibration: Calibration) -> str:
    from ..toolpath.posting.frames import find_frame_angles

    measured, name = calibration.measured, calibration.family.machine.name
    lines = [f"{name}: {len(calibration.sizes)} numbers from {measured.describe()}\n"]
    rows = []
    for before, found in zip(calibration.family.parameters, calibration.parameters, strict=True):
        digits = _LENGTH_DIGITS if found.unit == "mm" else _ANGLE_DIGITS
        numbers = before.value, found.value, found.value - before.value, found.deviation or 0.0
        texts = [format_fixed(to_display(number, found.unit), digits) for number in numbers]
        rows.append((found.name, *texts, name_display_unit(found.unit)))
    lines.append(format_table(rows, ("number", "was", "is", "change", "deviation", ""), " rrrr"))
    lines.append("")
    if calibration.fixed:
        more = f" and {len(calibration.fixed) - _MOST_NAMED} more" if len(calibration.fixed) > _MOST_NAMED else ""
        lines.append(f"kept, for others replace them: {' '.join(calibration.fixed[:_MOST_NAMED])}{more}")
    if calibration.centre is not None:
        lines.append(f"distances from {_format_place(calibration.centre)}")
    if calibration.frame is not None:
        turns = (format_fixed(to_display(x, "rad"), _ANGLE_DIGITS) for x in find_frame_angles(calibration.frame))
        place = _format_place(calibration.frame[:, 3])
        lines.append(f"the instrument's zero is at {place}, its A, B, C are {', '.join(turns)} deg")
    if calibration.outliers:
        rows_told = " ".join(str(row + 1) for row in calibration.outliers[:_MOST_NAMED])
        lines.append(f"outliers: measurement{'s' * (len(calibration.outliers) > 1)} {rows_told}")
    lines.append(
        f"weighed residual {calibration.fit:.3g} (1: what the stated noise explains), "
        f"{calibration.held_out:.3g} of measurements that the fit did not know"
    )
    lines.append(f"the tip is known to {1e3 * calibration.error:.3g} um over the workspace, root mean square")
    return "\n".join(lines)
