"""How Sphinx makes the pages of this folder: ``make docs``."""

import inspect
import re
from pathlib import Path

import parakin as pk
from parakin import __version__

project = "parakin"
author = "the authors of parakin"
release = version = __version__
html_title = f"parakin {__version__}"
extensions = ["myst_parser", "sphinx.ext.autodoc", "cyclopts.ext.sphinx"]
source_suffix = {".md": "markdown"}
myst_heading_anchors = 3
html_theme = "furo"
html_show_copyright = False
html_static_path = ["static"]
html_css_files = ["gallery.css"]
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # the docstrings say it, with shapes and units
autodoc_default_options = {"members": True}  # not fields: the docstring of their class describes them
suppress_warnings = ["ref.python"]  # attributes of one name in several classes

REFERENCE = (Path(__file__).parent / "reference" / "python.md").read_text(encoding="utf-8")
LINKS = {path.rpartition(".")[2]: f":class:`~{path}`" for path in re.findall(r"autoclass:: (parakin[\w.]+)", REFERENCE)}
FIELD = re.compile(r"^([A-Za-z_][\w, ]*?) : (.*)")
UNDERLINE = re.compile(r"^-{3,}$")


def link_type(annotation):
    """Link the classes of the reference in an annotation; empty where it names none."""
    annotation = getattr(annotation, "__forward_arg__", annotation)
    text = annotation.__name__ if inspect.isclass(annotation) else re.sub(r"(\w+\.)+(?=\w)", "", str(annotation))
    linked = re.sub(r"\w+", lambda word: LINKS.get(word[0], word[0]), text)
    return linked if linked != text else ""


def list_annotations(obj):
    """List the annotations of a class's fields and constructor, a function's arguments, or a property."""
    owners = [obj.__init__, *reversed(obj.__mro__)] if inspect.isclass(obj) else [getattr(obj, "fget", obj)]
    owners = [getattr(owner, "func", owner) for owner in owners]
    hints = {name: hint for owner in owners for name, hint in getattr(owner, "__annotations__", {}).items()}
    return {name: hint for name, hint in hints.items() if name != "return" or not inspect.isclass(obj)}


def write_fields_as_lists(app, what, name, obj, options, lines):
    """Write a docstring's lines of names, ``name : what it is``, as a list, and its headings as rubrics.

    All lists are of parameters or fields, so the heading that says so is left out. Classes that they are of, and those
    of an answer, are linked.
    """
    annotations, written = list_annotations(obj), []
    for number, line in enumerate(lines):
        field = FIELD.match(line)
        following = lines[number + 1] if number + 1 < len(lines) else ""
        if UNDERLINE.match(line):
            written.append("")
        elif UNDERLINE.match(following):
            written += ["", f".. rubric:: {line}"] if line != "Parameters" else []
        elif field:
            in_list = bool(written) and written[-1].startswith(("* ", "  "))
            kind = link_type(annotations.get(field[1], ""))
            written += [*([] if in_list else [""]), f"* ``{field[1]}``{kind and f' ({kind})'}: {field[2]}"]
        elif line.startswith("    ") and written and written[-1].startswith(("* ", "  ")):
            written.append(f"  {line.strip()}")
        else:
            if line and written and written[-1].startswith(("* ", "  ")):
                written.append("")
            written.append(line)
    answer = link_type(annotations.get("return", ""))
    written += ["", f"→ {answer}"] if answer else []
    lines[:] = [re.sub(r"\|(?=\w+ \w|\w+\|)", r"\\|", line) for line in written]


def skip_tuple_fields(app, what, name, obj, skip, options):
    """Leave out the fields of named tuples too, of which Python says their number only."""
    return True if type(obj).__name__ == "_tuplegetter" else None


def list_live_pages(app, docname, source):
    """Fill the gallery of live machines with what is shipped."""
    if docname == "live":
        cards = (
            f'<a class="machine" href="live/{name}.html"><img src="_images/{name}.png" alt="" loading="lazy">{name}</a>'
            for name in pk.machines()
        )
        source[0] = source[0].replace("MACHINES", "".join(cards))


def write_live_pages(app, exception):
    """Write the page of every machine beside the documentation."""
    if exception is None and app.builder.name == "html" and app.config.live_pages:
        folder = Path(app.outdir) / "live"
        folder.mkdir(exist_ok=True)
        for name in pk.machines():
            (folder / f"{name}.html").write_text(pk.render_machine_page(pk.load(name)), encoding="utf-8")


def setup(app):
    """Connect what this page adds to Sphinx."""
    app.add_config_value("live_pages", True, "html")
    app.connect("autodoc-process-docstring", write_fields_as_lists)
    app.connect("autodoc-skip-member", skip_tuple_fields)
    app.connect("source-read", list_live_pages)
    app.connect("build-finished", write_live_pages)
