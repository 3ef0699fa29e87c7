"use strict";
// The studio's page: forms of the commands, their runs, files, and the machines' own pages in frames.

const element = id => document.getElementById(id);
const state = {session: "", commands: [], machines: [], files: [], workpieces: {}, sizes: {}, edited: "", changed: false};

async function ask(path, options = {}) {
  const response = await fetch(path, options);
  const answer = await response.json();
  if (!response.ok) throw new Error(answer.error || response.statusText);
  return answer;
}

const inSession = path => `sessions/${state.session}/${path}`;
const escapeName = name => name.split("/").map(encodeURIComponent).join("/");
const CHOICE_STANDS = 0.4; // s
const pause = seconds => new Promise(resolve => setTimeout(resolve, 1000 * seconds));

function make(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

function fillSelect(select, options, chosen) {
  select.replaceChildren(...options.map(([value, text]) => make("option", {value, textContent: text})));
  if (options.some(([value]) => value === chosen)) select.value = chosen;
}

// Machines' pages.

const findFrame = name => element("stage").querySelector(`iframe[data-machine="${CSS.escape(name)}"]`);
const chosenMachines = () => [element("machine").value, element("second").value].filter((name, i, all) => name && all.indexOf(name) === i);

// Show a page in the place of a machine's own.
function showPage(name, file, act = () => {}) {
  const frame = make("iframe", {title: name, src: inSession(`page/${escapeName(file)}`)});
  frame.onload = () => { if (frame.contentWindow.parakin) act(frame.contentWindow.parakin); };
  frame.dataset.machine = name;
  const old = findFrame(name);
  if (old) old.replaceWith(frame);
  else element("stage").append(frame);
}

async function showMachines() {
  for (const frame of element("stage").querySelectorAll("iframe")) if (!chosenMachines().includes(frame.dataset.machine)) frame.remove();
  for (const name of chosenMachines()) {
    if (findFrame(name)) continue;
    delete state.sizes[name];
    const output = nameResult("page", name, ".html");
    const result = await run("page", {NAME: name, "--output": output});
    if (result && result.code === 0) showPage(name, output);
    else if (result) markLine(name, result.errors);
  }
}

// Show what was chosen once the choice stands: by the keyboard a list is gone through entry by entry.
let showTimer = 0;

function showMachinesSoon() {
  clearTimeout(showTimer);
  showTimer = setTimeout(showMachines, 1000 * CHOICE_STANDS);
}

// Select the line of the machine's file that an error names.
function markLine(name, errors) {
  const place = errors.match(/^[^\n:]+\.ya?ml:(\d+):/m);
  if (!place || element("text-name").value !== name) return;
  const text = element("text"), lines = text.value.split("\n"), number = +place[1];
  const begin = lines.slice(0, number - 1).join("\n").length + (number > 1 ? 1 : 0);
  element("editor").open = true;
  text.focus();
  text.setSelectionRange(begin, begin + lines[number - 1].length);
  text.scrollTop = (number - 0.5) / lines.length * text.scrollHeight - 0.5 * text.clientHeight;
}

// The sizes that were dragged on a machine's page, as the commands take them; a part's page is of these already.
function readSizes(name) {
  const shown = pageOf(name);
  if (shown && !shown.path) state.sizes[name] = writeSizes(shown.listOwnSizes());
  return state.sizes[name] || {};
}

function writeSizes(own) {
  return own.length ? {"--set": own.map(({name: size, unit, value}) => `${size}=${writeSize(value, unit)}`)} : {};
}

const writeSize = (value, unit) => unit === "rad" ? `${+(value * 180 / Math.PI).toFixed(6)}deg` : `${+value.toFixed(6)}${unit}`;

// The pose at which a machine stands on its page, as the commands take it.
function readPose(name) {
  const shown = pageOf(name);
  return shown ? shown.machine.axes.map((axis, i) => writeAxis(axis, shown.state.pose[i])) : null;
}

const writeAxis = ({name, unit}, value) => `${name}=${+(unit === "rad" ? value * 180 / Math.PI : value).toFixed(6)}`;

// What a workspace on a machine's page is of: its setting by the page's own name, and the options that ask a command for it, where
// orientation, working mode and sizes are not those of the file.
function readSetting(name) {
  const shown = pageOf(name), options = {...readSizes(name)};
  if (!shown) return {setting: null, options};
  const {machine: {axes, mode}, state: {pose, signs}} = shown;
  const turned = axes.map((axis, i) => [axis, pose[i]]).filter(([axis, value]) => axis.unit === "rad" && Math.abs(value - axis.home) > 1e-9);
  if (turned.length) options["--at"] = turned.map(([axis, value]) => writeAxis(axis, value)).join(",");
  if (signs.some((sign, i) => sign !== mode[i])) options["--mode"] = signs.map(sign => sign > 0 ? "+" : "-").join("");
  return {setting: shown.nameSetting(), options};
}

// A machine's file as it was written; where sizes were dragged, with these in it.
async function readMachineFile(name) {
  const sizes = readSizes(name);
  if (!Object.keys(sizes).length) {
    const response = await fetch(ownMachines().includes(name) ? inSession(`files/${escapeName(name)}`) : `machines/${escapeName(name)}`);
    if (response.ok) return response.text();
  }
  const {number} = await beginRun("show", {NAME: name, "--file": true, ...sizes});
  const result = await followRun(number);
  return result.code === 0 ? result.output : result.errors;
}

async function showMachineFile() {
  const name = element("machine").value, shown = JSON.stringify([name, readSizes(name)]);
  if (state.changed || state.edited === shown) return;
  state.edited = shown;
  const text = await readMachineFile(name);
  if (state.edited !== shown) return;
  element("text").value = text;
  element("text-name").value = ownMachines().includes(name) ? name : `my_${name}.yaml`;
}

async function saveMachineFile() {
  const typed = element("text-name").value.trim(), name = /\.ya?ml$/.test(typed) ? typed : `${typed}.yaml`;
  try {
    await ask(inSession(`files/${escapeName(name)}`), {method: "PUT", body: element("text").value});
  } catch (error) {
    element("runs").prepend(make("p", {className: "bad state", textContent: error.message}));
    return;
  }
  Object.assign(state, {edited: JSON.stringify([name, {}]), changed: false});
  element("text-name").value = name;
  await refreshFiles();
  findFrame(name)?.remove();
  element("machine").value = name;
  await showMachines();
}

// Forms.

function showForm() {
  const form = state.commands.find(one => one.command === element("command").value);
  element("command-help").textContent = form.help;
  element("form").replaceChildren(...form.fields.map(field => {
    const input = makeInput(field);
    input.id = `field-${field.name}`;
    input.dataset.name = field.name;
    input.title = field.help;
    input.addEventListener("input", showLine);
    return make("label", {title: field.help}, make("span", {textContent: field.name + (field.required ? " *" : "")}), input);
  }));
  showLine();
}

function makeInput(field) {
  if (field.kind === "flag") return make("input", {type: "checkbox"});
  if (field.many && field.name.startsWith("-")) return make("textarea", {className: "many", placeholder: "one a line"});
  if (field.kind === "choice" || (field.kind === "machine" && !field.many) || field.name === "PART") {
    const select = make("select");
    const parts = state.files.map(file => file.name).filter(name => !name.includes("/"));
    const options = field.kind === "choice" ? field.choices : field.name === "PART" ? parts : [...ownMachines(), ...state.machines];
    fillSelect(select, [...(field.required ? [] : [["", ""]]), ...options.map(name => [name, name])], startValue(field));
    return select;
  }
  return make("input", {type: "text", value: startValue(field), placeholder: field.default});
}

function startValue(field) {
  const command = element("command").value;
  if (field.kind === "machine") return !field.required ? "" : field.many ? chosenMachines().join(" ") : element("machine").value;
  if (field.name === "PART") return element("part").value;
  if (field.name === "VALUES" && command === "inverse") return (readPose(element("machine").value) || []).join(" ");
  if (field.name === "--at" && command === "reach") return (readPose(element("machine").value) || []).join(",");
  return field.kind === "choice" ? field.default : "";
}

function readForm() {
  const values = {};
  for (const input of element("form").querySelectorAll("[data-name]")) {
    const value = input.type === "checkbox" ? input.checked : input.value;
    const field = state.commands.find(one => one.command === element("command").value).fields.find(one => one.name === input.dataset.name);
    if (value && value !== field.default) values[field.name] = field.many ? value.split("\n") : value;
  }
  return values;
}

// The line as it will run; the server writes it again by its own rules, and tells what is wrong with it.
function showLine() {
  const quote = text => /^[\w@%+=:,./-]+$/.test(text) ? text : `'${text.replaceAll("'", "'\"'\"'")}'`;
  const words = ["parakin", element("command").value];
  for (const [name, value] of Object.entries(readForm())) {
    if (value === true) words.push(name);
    else for (const text of [value].flat()) words.push(name.startsWith("-") ? quote(`${name}=${text}`) : text.split(/\s+/).map(quote).join(" "));
  }
  element("line").textContent = words.join(" ");
}

// Files.

const ownMachines = () => state.files.map(file => file.name).filter(name => /^[^/]+\.ya?ml$/.test(name));

async function refreshFiles() {
  state.files = (await ask(inSession("files"))).files;
  const own = ownMachines(), machine = element("machine").value, second = element("second").value, part = element("part").value;
  const all = [...own, ...state.machines].map(name => [name, name]);
  fillSelect(element("machine"), all, machine);
  fillSelect(element("second"), [["", "nothing"], ...all], second);
  const parts = state.files.map(file => file.name).filter(name => /\.(aptsource|apt|cls?|ncl|ngc|nc|gcode|tap|cnc|txt)$/i.test(name));
  fillSelect(element("part"), [["", "none"], ...parts.map(name => [name, name])], part);
  element("all").href = inSession("packed.zip");
  element("files").replaceChildren(...state.files.map(file => make("li", {},
    make("a", {href: inSession(`files/${escapeName(file.name)}`), target: "_blank", rel: "noopener", textContent: file.name}),
    make("span", {textContent: file.size < 1e4 ? `${file.size} B` : `${(file.size / 1e3).toFixed(0)} kB`}))));
}

async function upload(files) {
  const taken = [];
  for (const file of files) {
    try {
      await ask(inSession(`files/${escapeName(file.name)}`), {method: "PUT", body: file});
      taken.push(file.name);
    } catch (error) {
      element("runs").prepend(make("p", {className: "bad state", textContent: error.message}));
    }
  }
  await refreshFiles();
  const last = taken.at(-1);
  if (ownMachines().includes(last)) { element("machine").value = last; await showMachines(); }
  else if ([...element("part").options].some(option => option.value === last)) element("part").value = last;
  showForm();
}

// What people do most, with a press.

const QUICK = {
  "Workspace": () => refineWorkspace(),
  "Largest box": () => findBox(),
  "Atlas": () => drawAtlas(),
  "Post the part": () => postPart(name => state.workpieces[`${name} ${element("part").value}`]),
  "Place it for me": () => postPart(() => ({"--place": "200mm"})),
  "Part at the tool": () => postPart(name => ({"--workpiece": findTip(name).map(([axis, value]) => `${axis}=${value}`).join(",")})),
  "Compare": () => compareMachines(),
  "LinuxCNC": () => exportToLinuxcnc(),
};

// Where the tool of a machine's page stands: pairs of an axis and its value.
function findTip(name = element("machine").value) {
  return (readPose(name) || []).map(text => text.split("=")).filter(([axis]) => "XYZ".includes(axis));
}

// Post the part on each machine, and play it there. Where it lies on one is remembered; on its page it can be moved.
async function postPart(place, machines = chosenMachines()) {
  const part = element("part").value;
  for (const name of machines) {
    const output = nameResult("on", name), options = place(name) || {};
    const result = await run("post", {PART: part, "--machine": name, "--output": output, "--page": true, ...readSizes(name), ...options});
    if (!result) return;
    const best = result.output.match(/^best placement --workpiece (\S+):/m);
    const workpiece = best ? best[1] : options["--workpiece"];
    if (workpiece) state.workpieces[`${name} ${part}`] = {"--workpiece": workpiece};
    const page = `${output}/${part.replace(/\.[^.]*$/, "")}.page.html`;
    if (state.files.some(file => file.name === page)) showPage(name, page, shown => {
      shown.offerPosting(text => postPart(() => ({"--workpiece": text}), [name]));
      const still = matchMedia("(prefers-reduced-motion: reduce)").matches;
      if (!shown.path.offences.length && !still) shown.setPlaying(true); // with offences it stands at the first one
    });
  }
}

// Start.

// Go on with the session of this tab where it is still there, with its files and runs.
async function openSession() {
  const key = `parakin ${location.pathname}`;
  state.session = sessionStorage.getItem(key);
  try {
    if (!state.session) throw new Error("a new tab");
    for (const {run, line} of (await ask(inSession("runs"))).runs) followRun(run, showRun(run, line));
  } catch {
    state.session = (await ask("sessions", {method: "POST"})).session;
    sessionStorage.setItem(key, state.session);
  }
}

async function start() {
  const described = await ask("commands");
  state.commands = described.commands;
  state.machines = described.machines;
  await openSession();
  fillSelect(element("machine"), [[described.start.machine, described.start.machine]], described.start.machine);
  await refreshFiles();
  element("machine").value = described.start.machine;
  element("part").value = described.start.part;
  fillSelect(element("command"), state.commands.map(form => [form.command, form.command]), "workspace");
  element("quick").append(...Object.entries(QUICK).map(([text, act]) => make("button", {textContent: text, type: "button", onclick: act})));
  element("machine").onchange = () => {
    showForm();
    if (element("editor").open) showMachineFile();
    showMachinesSoon();
  };
  element("second").onchange = showMachinesSoon;
  element("part").onchange = showForm;
  element("command").onchange = showForm;
  element("form").onsubmit = event => event.preventDefault();
  element("run").onclick = () => run(element("command").value, readForm());
  element("copy").onclick = () => navigator.clipboard.writeText(element("line").textContent);
  element("save").onclick = saveMachineFile;
  for (const event of ["toggle", "pointerenter", "focusin"]) // sizes may have been dragged since
    element("editor").addEventListener(event, () => { if (element("editor").open) showMachineFile(); });
  element("text").oninput = () => { state.changed = true; };
  element("upload").onchange = event => upload(event.target.files);
  const drop = element("drop");
  drop.onclick = () => element("upload").click();
  drop.onkeydown = event => { if (event.key === "Enter" || event.key === " ") element("upload").click(); };
  document.ondragover = event => { event.preventDefault(); drop.classList.add("over"); };
  document.ondragleave = () => drop.classList.remove("over");
  document.ondrop = event => { event.preventDefault(); drop.classList.remove("over"); upload(event.dataTransfer.files); };
  showForm();
  await showMachines();
  document.body.dataset.ready = "yes";
}

window.studio = {state, run, readPose, showMachines, refreshFiles, findFrame};
start();
