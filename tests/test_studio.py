"""The studio answers only its own page, runs what its forms say and nothing else, and its page works in Chromium."""

import json
import signal
import socket
import time
from contextlib import suppress
from io import BytesIO
from pathlib import Path
from zipfile import ZipFile

import pytest
from browser import list_pale_texts, needs_chromium, open_browser, open_tab, wait_until
from studio_client import run_studio

import parakin as pk
from parakin.cli import app, main
from parakin.commands.studio import make_forms
from parakin.errors import InputError
from parakin.studio.forms import write_line

FORMS = make_forms(app)
RPR3 = (Path(pk.__file__).parent / "machines" / "rpr3.yaml").read_text(encoding="utf-8")
PART = "UNITS/MM\nFEDRAT/900,MMPM\nRAPID\nGOTO/0,0,0\nGOTO/40,10,0\nGOTO/40,-30,0\nFINI\n"


@pytest.fixture(scope="module")
def studio(tmp_path_factory):
    folder = tmp_path_factory.mktemp("studio")
    (folder / "own.yaml").write_text(RPR3, encoding="utf-8")
    (folder / "part.apt").write_text(PART, encoding="utf-8")
    with run_studio(folder, "own.yaml", "part.apt") as client:
        yield client
    assert not [path for path in folder.iterdir() if path.is_dir()]  # the sessions' files are gone


# Forms.


def test_every_command_has_a_form():
    assert set(FORMS) == {name for name in app if not name.startswith("-")} - {"studio"}
    for form in FORMS.values():
        assert form.help
        assert not [field.name for field in form.fields if not field.help]


def test_a_line_is_what_was_filled_in():
    values = {"NAME": "tricept", "VALUES": ["X=10 Z=-1500"], "--mode": "+", "--set": ["R=360mm", "r=90 mm"]}
    assert write_line(FORMS["inverse"], values) == [
        "inverse", "tricept", "X=10", "Z=-1500", "--mode=+", "--set=R=360mm", "--set=r=90 mm",
    ]  # fmt: skip
    values = {"PART": "a.cls", "--machine": "tricept", "--parquet": True, "--corners": "stop", "--rate": "  "}
    assert write_line(FORMS["post"], values) == ["post", "a.cls", "--machine=tricept", "--corners=stop", "--parquet"]
    assert write_line(FORMS["forward"], {"NAME": "rpr3", "VALUES": "-1 2 .5"}) == ["forward", "rpr3", "-1", "2", ".5"]


@pytest.mark.parametrize(
    ("command", "values", "said"),
    [
        ("inverse", {}, "NAME is missing"),
        ("inverse", {"NAME": "/etc/passwd"}, "not a plain file name"),
        ("inverse", {"NAME": "../own.yaml"}, "not a plain file name"),
        ("inverse", {"NAME": "--help"}, "not a plain file name"),
        ("inverse", {"NAME": "tricept", "VALUES": ["--json"]}, "read as an option"),
        ("inverse", {"NAME": "tricept", "--csv": "/etc/passwd"}, "not a plain file name"),
        ("inverse", {"NAME": "tricept", "--output": "a/../../b"}, "not a plain file name"),
        ("workspace", {"NAME": "tricept", "--output": ["a.svg", "/tmp/b.svg"]}, "not a plain file name"),
        ("compare", {"NAMES": "tricept ../own.yaml"}, "not a plain file name"),
        ("design", {"FAMILY": "/tmp/problem.yaml"}, "not a plain file name"),
        ("inverse", {"NAME": "tricept", "--mode": ["+", "-"]}, "one value"),
        ("inverse", {"NAME": "tricept", "--install-completion": True}, "no parameter"),
        ("inverse", {"NAME": "tricept", "--mode": "a" * 3000}, "at most 2000"),
        ("inverse", {"NAME": "tricept", "--mode": "a\nb"}, "a text"),
        ("inverse", {"NAME": "tricept", "--mode": 7}, "a text"),
        ("inverse", {"NAME": ["a", {}]}, "a text"),
        ("post", {"PART": "a", "--machine": "b", "--target": "haas"}, "one of linuxcnc"),
        ("post", {"PART": "a", "--machine": "b", "--force": "yes"}, "true or false"),
    ],
)
def test_a_line_that_can_not_be_is_refused(command, values, said):
    with pytest.raises(InputError, match=said):
        write_line(FORMS[command], values)


# The server.


def test_foreign_requests_are_refused(studio):
    own = f"127.0.0.1:{studio.port}"
    for host in (
        "evil.example",
        "evil.example:80",
        "127.0.0.1",
        f"127.0.0.1:{studio.port + 1}",
        f"{own}.evil.example",
        "",
    ):
        assert studio.request("commands", headers={"Host": host})[0] == 403, host
    for origin in ("http://evil.example", "null", f"https://{own}", f"http://{own}.evil.example", "file://"):
        assert studio.request("sessions", "POST", headers={"Origin": origin})[0] == 403, origin
    for path in ("/", "/commands", studio.prefix[:-2] + "/commands", studio.prefix.upper(), "/x" + studio.prefix, "//"):
        assert studio.request(path, whole=True)[0] == 403, path
    assert studio.request("", headers={"Origin": f"http://{own}"})[0] == 200
    assert studio.request("", headers={"Host": f"localhost:{studio.port}"})[0] == 200


@pytest.mark.parametrize("token", [True, False])
def test_there_is_no_websocket(studio, token):
    headers = {
        "Upgrade": "websocket",
        "Connection": "Upgrade",
        "Sec-WebSocket-Version": "13",
        "Sec-WebSocket-Key": "a" * 24,
    }
    status, _ = studio.request("" if token else "/", headers=headers, whole=not token)
    assert status == 403


def test_it_listens_on_this_computer_only(studio):
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
        probe.settimeout(2.0)
        with pytest.raises(OSError):
            probe.connect(("127.0.0.2", studio.port))


def test_a_page_has_its_own_files(studio):
    first, second = studio.open_session(), studio.open_session()
    assert studio.put_file(first, "mine.yaml", RPR3.replace("rpr3", "mine"))[0] == 200
    names = [[file["name"] for file in studio.ask(f"sessions/{s}/files")[1]["files"]] for s in (first, second)]
    assert names == [["mine.yaml", "own.yaml", "part.apt"], ["own.yaml", "part.apt"]]
    assert studio.request(f"sessions/{first}/files/mine.yaml")[1].decode() == RPR3.replace("rpr3", "mine")
    assert studio.ask(f"sessions/{second}/files/mine.yaml")[0] == 404
    assert studio.ask("sessions/nothing/files")[0] == 404
    assert studio.request("machines/rpr3") == (200, RPR3.encode())
    for name in ("nothing", "..%2Frpr3", "rpr3.yaml"):
        assert studio.request(f"machines/{name}")[0] == 404


@pytest.mark.parametrize(
    "name", ["matplotlibrc", "../a", "..%2Fa", "a/b", ".hidden", "a\0b", "C:\\a", "a" * 100, "%2e%2e", "a..", ""]
)
def test_no_file_is_written_elsewhere(studio, name):
    session = studio.open_session()
    status, _ = studio.request(f"sessions/{session}/files/{name}".replace("\0", "%00").replace("\\", "%5C"), "PUT", "x")
    assert status in (400, 404)
    assert [file["name"] for file in studio.ask(f"sessions/{session}/files")[1]["files"]] == ["own.yaml", "part.apt"]


def test_no_upload_is_run_as_code(studio):
    session = studio.open_session()
    for name in ("parakin.py", "numpy.py", "sitecustomize.py"):
        assert studio.put_file(session, name, "raise SystemExit('code of an upload')")[0] == 200
    told = studio.run(session, "machines", {})
    assert (told["code"], "orthoglide" in told["output"]) == (0, True)


def test_no_upload_leads_to_files_elsewhere(studio, tmp_path):
    (tmp_path / "secret.hal").write_text("setp genhexkins.base.0.x SECRET\n")
    session = studio.open_session()
    ini = f"[KINS]\nKINEMATICS = genhexkins\n[TRAJ]\nLINEAR_UNITS = mm\n[HAL]\nHALFILE = {tmp_path}/secret.hal\n"
    problem = f"machine: {tmp_path}/secret.hal\nfree: {{R: [1 mm, 2 mm]}}\nbox: {{X: 0 mm}}\nminimise: R\n"
    for name, text, command, word in (
        ("machine.ini", ini, "import", "FILE"),
        ("printer.cfg", "[include ../*/*]\n[printer]\nkinematics: delta\n", "import", "FILE"),
        ("problem.yaml", problem, "design", "FAMILY"),
    ):
        studio.put_file(session, name, text)
        told = studio.run(session, command, {word: name})
        assert told["code"] == 2
        assert told["errors"].startswith(f"{name}:") and told["errors"].count("\n") == 1
        assert "outside" in told["errors"]
        assert "SECRET" not in told["errors"]


def test_a_folder_is_no_file(studio):
    session = studio.open_session()
    assert studio.run(session, "linuxcnc", {"NAME": "linear_delta", "--output": "lc"})["code"] == 0
    before = studio.ask(f"sessions/{session}/files")
    names = {file["name"] for file in before[1]["files"]}
    for way, own in (("packed.zip", names), ("packed/lc.zip", {name for name in names if name.startswith("lc/")})):
        with ZipFile(BytesIO(studio.request(f"sessions/{session}/{way}")[1])) as archive:
            assert set(archive.namelist()) == own
            assert archive.read("lc/linear_delta.ini").startswith(b"#")
    for name in ("nothing", "..", "own.yaml%2F..%2F..", "lc/.."):
        assert studio.request(f"sessions/{session}/packed/{name}.zip")[0] in (400, 404)
    assert studio.put_file(session, "lc", "x")[0] == 400
    assert studio.ask(f"sessions/{session}/files") == before


def test_names_that_people_give(studio):
    session = studio.open_session()
    for name in ("part (1).cls", "Größe.nc"):
        assert studio.put_file(session, name, PART)[0] == 200
    assert studio.run(session, "post", {"PART": "part (1).cls", "--machine": "own.yaml"})["code"] == 0


@pytest.mark.parametrize("end", [signal.SIGHUP, signal.SIGTERM, signal.SIGKILL], ids=lambda end: end.name)
def test_nothing_goes_on_once_it_has_ended(tmp_path, end):
    """Its terminal closed, told to end, or killed."""
    with run_studio(tmp_path, end=end) as client:
        session = client.open_session()
        client.begin_run(session, "atlas", {"NAME": "hexapod", "--step": "10"})
        if end != signal.SIGHUP:  # which comes before the command has begun
            time.sleep(1.0)
        runs = list_processes(tmp_path)
        assert runs or end == signal.SIGHUP
    if end != signal.SIGKILL:
        assert not list(tmp_path.iterdir())
    until = time.monotonic() + 10.0
    while list_processes(tmp_path):
        assert time.monotonic() < until
        time.sleep(0.05)


def list_processes(folder):
    """List the processes that work in a folder of a folder."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):  # it has ended
            found += [process] if folder in (process / "cwd").readlink().parents else []
    return found


@pytest.mark.parametrize(("path", "said"), [("files/large.cls", "larger than 64 MiB"), ("runs", "larger than 100 KiB")])
def test_what_is_too_large_is_refused_before_it_is_read(studio, path, said):
    session = studio.open_session()
    with socket.create_connection(("127.0.0.1", studio.port), timeout=20) as client:
        method = "POST" if path == "runs" else "PUT"
        head = f"{method} {studio.prefix}sessions/{session}/{path} HTTP/1.1\r\nHost: 127.0.0.1:{studio.port}\r\n"
        client.sendall(f"{head}Content-Length: {64 * 2**20 + 1}\r\n\r\n".encode())
        answer = client.makefile("rb").read().decode()  # to the connection's end
    assert answer.startswith("HTTP/1.1 413 ")
    assert said in answer


def test_an_upload_of_no_announced_size_is_bounded(studio):
    session = studio.open_session()
    chunks = (b"x" * 2**20 for _ in range(65))
    status, answer = studio.put_file(session, "large.cls", chunks)
    assert status == 413
    assert "larger than 64 MiB" in answer["error"]


def test_a_client_that_leaves_amid_an_upload_leaves_nothing(studio):
    """Not a line in the terminal either, which the end of the fixture's studio looks at."""
    session = studio.open_session()
    before = studio.ask(f"sessions/{session}/files")
    for method, path in (("PUT", "files/half.cls"), ("POST", "runs")):
        with socket.create_connection(("127.0.0.1", studio.port)) as client:
            head = f"{method} {studio.prefix}sessions/{session}/{path} HTTP/1.1\r\nHost: 127.0.0.1:{studio.port}\r\n"
            client.sendall(f"{head}Content-Length: 1000\r\n\r\nhalf".encode())
            time.sleep(0.1)
    assert studio.ask(f"sessions/{session}/files") == before
    assert studio.ask(f"sessions/{session}/runs") == (200, {"runs": []})


@pytest.mark.parametrize(
    "body",
    ["", "[]", "{", "7", '{"command": "rm"}', '{"command": "show", "values": 3}', "[" * 50000]
    + [f'{{"command": "machines", "values": {{}}, "columns": {columns}}}' for columns in ("0", '"9"', "null", "1e9")],
)
def test_a_malformed_run_is_refused(studio, body):
    session = studio.open_session()
    status, answer = studio.request(f"sessions/{session}/runs", "POST", body)
    assert status == 400
    assert json.loads(answer)["error"]


def test_runs_say_what_the_commands_say(studio, capsys, tmp_path, monkeypatch):
    session = studio.open_session()
    told = studio.run(session, "inverse", {"NAME": "own.yaml", "VALUES": ["X=10 Y=-5"]})
    (tmp_path / "own.yaml").write_text(RPR3, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    assert main(["inverse", "own.yaml", "X=10", "Y=-5"]) == 0
    assert (told["code"], told["output"]) == (0, capsys.readouterr().out)
    assert told["line"] == "parakin inverse own.yaml X=10 Y=-5"
    studio.put_file(session, "bad.yaml", RPR3.replace("kind: length", "kind: lenght"))
    told = studio.run(session, "show", {"NAME": "bad.yaml", "--yaml": True})
    assert told["code"] == 2
    assert told["errors"].startswith("bad.yaml:")
    told = studio.run(session, "post", {"PART": "part.apt", "--machine": "own.yaml", "--output": "out", "--page": True})
    assert told["code"] == 0
    names = {file["name"] for file in studio.ask(f"sessions/{session}/files")[1]["files"]}
    assert {"out/part.joints.csv", "out/part.report.html", "out/part.page.html"} <= names
    assert studio.request(f"sessions/{session}/page/out/part.page.html")[0] == 200


def test_a_run_can_be_cancelled_and_blocks_nothing(studio):
    session = studio.open_session()
    values = {"NAME": "hexapod", "--gap": "0.0001", "--time": "600"}
    runs = [studio.begin_run(session, "workspace", values)[1]["run"] for _ in range(3)]
    time.sleep(1.0)
    assert studio.ask("commands")[0] == 200
    states = [studio.ask(f"sessions/{session}/runs/{run}")[1]["state"] for run in runs]
    assert states == ["running", "running", "waiting"]
    begun = time.monotonic()
    ended = [studio.ask(f"sessions/{session}/runs/{run}", "DELETE")[1]["state"] for run in reversed(runs)]
    assert ended == ["cancelled"] * 3
    assert time.monotonic() - begun < 10.0
    assert studio.ask(f"sessions/{session}/runs/999")[0] == 404


# The command.


def test_bad_arguments_are_one_line(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".hidden.cls").write_text(PART, encoding="utf-8")
    for words, said in (
        (["nothing"], "unknown machine"),
        (["tricept", "nothing.cls"], "nothing.cls"),
        (["tricept", ".hidden.cls"], "plain file name"),
        (["--port", "70000"], "--port"),
        (["--port", "-1"], "--port"),
    ):
        assert main(["studio", "--no-browser", *words]) == 2, words
        error = capsys.readouterr().err
        assert said in error
        assert len(error.splitlines()) == 1


# The page.

PRESS = """() => {
  let seed = 7;
  const next = many => { seed = (1103515245 * seed + 12345) % 2147483648; return seed % many; };
  const texts = ["", "1", "X=1", "-", "\\u0000", "../a"];
  for (let i = 0; i < 300; i++) {
    if (next(4)) {
      const select = document.getElementById("command");
      select.selectedIndex = next(select.options.length);
      select.onchange();
    } else {
      for (const input of document.querySelectorAll("#form [data-name]")) {
        if (input.type === "checkbox") input.checked = !!next(2);
        else input.value = texts[next(texts.length)];
        input.dispatchEvent(new Event("input"));
      }
    }
    if (i % 100 === 0) document.getElementById("run").click();
    if (i % 100 === 50) document.querySelector("#runs button")?.click();
  }
}"""


@needs_chromium
def test_the_page_in_a_browser(studio):
    with open_browser() as browser, open_tab(browser, 1400, 900) as tab:
        tab.goto(studio.address)
        wait_until(tab, "document.body.dataset.ready === 'yes' && studio.readPose('own.yaml') !== null", 40.0)
        assert tab.evaluate("studio.readPose('own.yaml')") == ["X=0", "Y=0", "C=0"]
        tab.frames[1].evaluate("parakin.moveToPose([10, -5, 0.1])")
        tab.click("text=Any command")
        tab.select_option("#command", "inverse")
        assert tab.inner_text("#line").startswith("parakin inverse own.yaml X=10 Y=-5 C=5.72957")
        tab.click("#run")
        wait_until(tab, "document.querySelector('.run').innerText.includes('parakin inverse')", 30.0)
        wait_until(tab, "document.querySelector('.run .state').textContent.startsWith('exit 0')", 30.0)
        assert "d1" in tab.inner_text(".run pre")
        tab.evaluate("document.querySelector('aside').style.width = '300px'")
        tab.select_option("#command", "show")
        tab.click("#run")
        wait_until(tab, "document.querySelector('.run').innerText.match(/parakin show.* exit 0/)", 30.0)
        assert "\nd1\n  from" in tab.inner_text(".run pre")  # the table of drives is turned where it is too wide
        tab.evaluate("document.querySelector('aside').style.width = ''")
        page = tab.frames[1]
        tab.click("text=Largest box")
        wait_until(tab, "/ --at=C=5.729578 .*--box/.test(document.querySelector('.run code').textContent)")
        page.evaluate("parakin.moveToPose([0, 0, -0.1])")  # while it runs
        wait_until(page, "parakin.shown.box !== null", 40.0)
        assert page.evaluate("parakin.shown.visible") == [False, False, False]
        page.evaluate("parakin.moveToPose([10, -5, 0.1])")
        assert page.evaluate("parakin.shown.visible") == [False, True, False]
        (low, high) = page.evaluate("parakin.shown.box")
        assert not pk.load("rpr3").check([[x, y, 0.1] for x in (low[0], high[0]) for y in (low[1], high[1])]).any()
        tab.click("button:has-text('Atlas')")
        wait_until(page, "parakin.shown.values > 20", 40.0)
        assert "1/condition number, violet 0 to yellow 1" in page.locator("aside").inner_text()
        page.evaluate("parakin.moveToSizes([510, 120])")
        tab.click("text=Place it for me")
        wait_until(tab, "studio.findFrame('own.yaml')?.src.includes('part.page.html')", 60.0)
        said = tab.inner_text("#runs")
        assert (
            "parakin post part.apt --machine=own.yaml --place=200mm --output=on_own --page --set=R=510mm exit 0" in said
        )
        assert "all within the limits" in said
        tab.click("button:has-text('Compare')")  # the machines as they are shown
        wait_until(
            tab, "document.querySelector('.run code').textContent.startsWith('parakin compare sized_own.yaml --part')"
        )
        tab.evaluate("document.querySelector('.run button').click()")  # to cancel it
        tab.click("button:has-text('LinuxCNC')")
        wait_until(
            tab,
            "[...document.querySelectorAll('.run a')].some(a => a.textContent === 'linuxcnc_own.zip, all of these')",
        )
        page = next(frame for frame in tab.frames if "part.page.html" in frame.url)
        wait_until(page, "document.getElementById('post')?.hidden === false", 20.0)
        assert page.evaluate("parakin.player.playing || parakin.player.time > 0")
        page.evaluate("parakin.movePath([2, 0, 0])")
        tab.emulate_media(reduced_motion="reduce")
        tab.evaluate("studio.findFrame('own.yaml').dataset.old = 'yes'")
        page.click("#post")
        again = "/--workpiece=X=.*--set=R=510mm/"
        wait_until(tab, f"[...document.querySelectorAll('.run code')].some(one => {again}.test(one.textContent))")
        shown = "studio.findFrame('own.yaml')"
        wait_until(
            tab, f"!{shown}.dataset.old && {shown}.contentDocument.getElementById('post')?.hidden === false", 60.0
        )
        page = next(frame for frame in tab.frames if "part.page.html" in frame.url)
        assert page.evaluate("[parakin.player.playing, parakin.player.time]") == [False, 0]  # nothing moves by itself
        page.click("#play")
        wait_until(page, "parakin.player.time > 0")
        tab.click("summary:has-text('Edit the machine')")
        wait_until(tab, "document.getElementById('text').value.includes('kind: length')", 20.0)
        text = tab.input_value("#text")
        assert text == RPR3.replace("R: 500 mm", "R: 510mm")  # as it was written, with the size that was dragged
        remarks = "# a remark\n" * 60
        tab.fill("#text", remarks + text.replace("kind: length", "kind: lenght", 1) + remarks)
        tab.click("#save")
        wait_until(tab, "getSelection().toString().includes('lenght')", 20.0)  # the line that the error names
        lines = [*(remarks + text).split("\n"), *remarks.split("\n")[1:]]
        number = next(number for number, line in enumerate(lines) if "kind: length" in line)
        top, height, whole = tab.evaluate("(({scrollTop, clientHeight, scrollHeight}) => [scrollTop, clientHeight, "
                                          "scrollHeight])(document.getElementById('text'))")  # fmt: skip
        assert top < number / len(lines) * whole < top + height  # and it is in view
        assert ".yaml:" in tab.inner_text("#runs .run pre")
        tab.fill("#text", text)
        tab.click("#save")
        wait_until(tab, "studio.findFrame('my_own.yaml') !== null || studio.findFrame('own.yaml') !== null", 20.0)
        for scheme in ("light", "dark"):
            tab.emulate_media(color_scheme=scheme)
            assert not list_pale_texts(tab)
        runs = tab.evaluate("document.querySelectorAll('.run').length")
        tab.reload()
        wait_until(tab, "document.body.dataset.ready === 'yes'", 40.0)
        assert tab.evaluate("document.querySelectorAll('.run').length") >= runs  # the same session


PRESSED = [
    ["workspace", {"--gap": "0.3", "--output": ["workspace_rrr3.svg"], "--at": "C=5.729578", "--mode": "-++"}],
    ["workspace", {"--box": True, "--output": ["box_rrr3.json"], "--at": "C=5.729578", "--mode": "-++"}],
    ["atlas", {"--output": "atlas_rrr3", "--at": "C=5.729578", "--mode": "-++"}],
    ["post", {"PART": "part.apt", "--page": True, "--output": "on_rrr3"}],
    ["post", {"PART": "part.apt", "--page": True, "--output": "on_rrr3", "--place": "200mm"}],
    ["post", {"PART": "part.apt", "--page": True, "--output": "on_rrr3", "--workpiece": "X=10,Y=-5"}],
    ["compare", {"--part": "part.apt", "--output": "compared.html"}],
    ["linuxcnc", {"--output": "linuxcnc_rrr3"}],
]
FOCUSED = "(e => e.id || e.textContent)(document.activeElement)"


def press_all(tab):
    """Go through the studio from the first Tab on, and press all that begins a run; what each asks for."""
    asked, ways = [], []

    def answer(route):
        if route.request.method == "POST":
            asked.append(route.request.post_data_json)
        route.fulfill(status=400, json={"error": f"not now {len(asked)}"})

    tab.route("**/runs", answer)
    for _ in range(5):
        tab.keyboard.press("Tab")
        ways.append(tab.evaluate(FOCUSED))
    assert ways == ["machine", "second", "part", "drop", "Edit the machine's file"]
    for number, _ in enumerate(PRESSED, 1):
        tab.keyboard.press("Tab")
        tab.keyboard.press("Enter")
        wait_until(tab, f"document.querySelector('#runs p.bad')?.textContent === 'not now {number}'")
    tab.keyboard.press("Tab")
    assert tab.evaluate(FOCUSED) == "Any command"
    tab.select_option("#second", "own.yaml")  # which begins a run of its page
    wait_until(tab, f"document.querySelector('#runs p.bad').textContent === 'not now {len(PRESSED) + 1}'")
    tab.click("#quick button:text-is('Compare')")
    wait_until(tab, f"document.querySelector('#runs p.bad').textContent === 'not now {len(PRESSED) + 2}'")
    *asked, page, compare = asked
    assert (page["command"], page["values"]["NAME"]) == ("page", "own.yaml")
    assert (compare["command"], compare["values"]["NAMES"]) == ("compare", ["rrr3", "own.yaml"])
    tab.select_option("#second", "")
    tab.unroute("**/runs")
    return asked


DROP = """([name, length]) => {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([new Uint8Array(length).fill(10)], name));
  document.dispatchEvent(new DragEvent("drop", {dataTransfer, cancelable: true}));
}"""


@needs_chromium
def test_seeded_presses_leave_it_alive(studio):
    with open_browser() as browser, open_tab(browser, 1100, 700) as tab:
        tab.goto(studio.address)
        wait_until(tab, "document.body.dataset.ready === 'yes'", 40.0)
        tab.select_option("#machine", "rrr3")
        wait_until(tab, "studio.readPose('rrr3') !== null", 40.0)
        tab.frames[1].evaluate("parakin.moveToPose([10, -5, 0.1]), parakin.switchSign(0)")
        for one, (command, values) in zip(press_all(tab), PRESSED, strict=True):
            machine = {"post": "--machine", "compare": "NAMES"}.get(command, "NAME")
            name = ["rrr3"] if command == "compare" else "rrr3"
            assert (one["command"], one["values"]) == (command, values | {machine: name})
        tab.evaluate(DROP, ["dropped.apt", 9])
        wait_until(tab, "document.getElementById('part').value === 'dropped.apt'")
        tab.evaluate(DROP, ["table.csv", 9])
        wait_until(tab, "document.getElementById('files').textContent.includes('table.csv')")
        tab.evaluate(DROP, ["large.apt", 2**26 + 1])
        wait_until(tab, "document.querySelector('#runs p.bad').textContent.startsWith('large.apt: larger than 64 MiB')")
        assert tab.evaluate("document.getElementById('part').value") == "dropped.apt"
        tab.context.grant_permissions(["clipboard-read", "clipboard-write"])
        tab.click("#runs .run button:text-is('Copy')")
        assert tab.evaluate("navigator.clipboard.readText()") == "parakin page rrr3 --output=page_rrr3.html"
        tab.evaluate(PRESS)
        wait_until(
            tab,
            "studio.state.files.length > 0 && document.getElementById('line').textContent.startsWith('parakin ')",
            20.0,
        )
        tab.click("text=Any command")
        tab.select_option("#command", "machines")
        tab.click("#run")
        wait_until(tab, "document.querySelector('#runs').textContent.includes('orthoglide')", 60.0)
