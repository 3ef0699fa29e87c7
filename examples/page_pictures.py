"""Pictures of the page, the studio, a comparison and a front of designs, as they stand in Chromium.

python examples/page_pictures.py [-o FOLDER]

It needs Chromium (scripts/chromium.sh) and playwright, which is among the developer's packages.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import parakin as pk

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests"))
from browser import open_browser, open_tab, wait_until  # noqa: E402
from studio_client import run_studio  # noqa: E402

POCKET = """UNITS/MM
FEDRAT/1200,MMPM
RAPID
GOTO/-40,-30,50
GOTO/-40,-30,0
GOTO/40,-30,0
GOTO/40,30,0
GOTO/-40,30,0
GOTO/-40,-30,0
RAPID
GOTO/-40,-30,50
FINI
"""
BLADE = "turbine_blade"


def show_page(browser, folder: Path, picture: Path) -> None:
    """A Tricept with its workspace, dragged to the end of a strut's range."""
    file = folder / "tricept.html"
    file.write_text(pk.render_machine_page(pk.load("tricept")), encoding="utf-8")
    with open_tab(browser) as tab:
        tab.goto(file.as_uri())
        tab.locator("#workspace").check()
        tab.evaluate("parakin.moveToPose([600, 360, -1850, 0.36, 0.24])")
        wait_until(tab, "parakin.surface.level === 2", 60.0)
        tab.evaluate("document.getElementById('panel').scrollTop = 0")
        tab.wait_for_timeout(1000)
        tab.screenshot(path=picture)


def show_path(browser, folder: Path, picture: Path) -> None:
    """The turbine blade's path from near, while it is played."""
    for words in (
        [HERE / f"{BLADE}.py", "-o", folder],
        ["-m", "parakin", "post", folder / f"{BLADE}.aptsource", "--machine", "tricept", "--page", "-o", folder],
    ):
        subprocess.run([sys.executable, *map(str, words)], check=True, capture_output=True)
    with open_tab(browser) as tab:
        tab.goto((folder / f"{BLADE}.page.html").as_uri())
        tab.get_by_role("button", name="Path", exact=True).click()
        tab.evaluate("parakin.seek(0.39 * parakin.path.end)")
        tab.wait_for_timeout(1000)
        tab.screenshot(path=picture)


def show_studio(browser, folder: Path, picture: Path) -> None:
    """A posted pocket within the proved workspace."""
    (folder / "pocket.cls").write_text(POCKET)
    with run_studio(folder, "tricept", "pocket.cls") as studio, open_tab(browser, 1440, 900) as tab:
        tab.goto(studio.address)
        wait_until(tab, "document.body.dataset.ready === 'yes'", 60.0)
        wait_until(tab, "document.querySelector('iframe')?.contentWindow.parakin?.pictures > 0", 60.0)
        tab.get_by_role("button", name="Part at the tool").click()
        wait_until(tab, "document.querySelector('iframe')?.contentWindow.parakin?.path", 120.0)
        tab.get_by_role("button", name="Workspace", exact=True).click()
        wait_until(
            tab, "[...document.querySelectorAll('.run')].some(run => /gap=0.1.*exit 0/s.test(run.textContent))", 240.0
        )
        tab.wait_for_timeout(1500)
        tab.screenshot(path=picture)


def show_comparison(browser, folder: Path, picture: Path) -> None:
    """Three machines side by side."""
    machines = [pk.load(name) for name in ("orthoglide", "linear_delta", "hexapod")]
    compared = pk.compare(machines, tolerances=[("feet", "0.05 mm")], drives="100 N/um")
    (folder / "compared.html").write_text(pk.render_comparison_page(compared), encoding="utf-8")
    with open_tab(browser, 1000, 640) as tab:
        tab.goto((folder / "compared.html").as_uri())
        tab.screenshot(path=picture)


def show_front(browser, folder: Path, picture: Path) -> None:
    """Designs of an Orthoglide for a cube of 200 mm, one of them chosen."""
    cube, free = dict.fromkeys("XYZ", (-100.0, 100.0)), {"L": (150.0, 500.0)}
    shift, bounds = {"X Y Z": (-150.0, 150.0)}, {"amplification": 3.0}
    glide = pk.load("orthoglide")
    designs = pk.find_designs(
        pk.DesignProblem(glide, free, cube, ["L", "amplification"], shift, bounds, fit_strokes=True)
    )
    (folder / "front.html").write_text(pk.render_front_page(designs), encoding="utf-8")
    with open_tab(browser, 1360, 900) as tab:
        tab.goto((folder / "front.html").as_uri() + "#design_5")
        wait_until(tab, "document.querySelector('iframe')?.contentWindow.parakin?.pictures > 0", 60.0)
        tab.wait_for_timeout(1000)
        tab.screenshot(path=picture)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/pictures"))
    output = parser.parse_args().output
    output.mkdir(parents=True, exist_ok=True)
    pictures = {
        "page": show_page,
        "page_path": show_path,
        "studio": show_studio,
        "comparison": show_comparison,
        "front": show_front,
    }
    for name, show in pictures.items():
        with tempfile.TemporaryDirectory() as folder, open_browser() as browser:
            show(browser, Path(folder), output / f"{name}.png")
            print(output / f"{name}.png")


if __name__ == "__main__":
    main()
