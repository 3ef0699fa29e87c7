"use strict";
// Results of runs, drawn on the machines' own pages.

const nameResult = (kind, machine, ending = "") => `${kind}_${machine.replace(/\.ya?ml$/, "")}${ending}`;
const fetchResult = name => fetch(inSession(`files/${escapeName(name)}`));
const pageOf = name => findFrame(name)?.contentWindow.parakin;

// The proved workspace of each machine, at rising resolution, drawn about it.
async function refineWorkspace() {
  for (const gap of ["0.3", "0.1", "0.02"]) {
    for (const name of chosenMachines()) {
      const spatial = findTip(name).length === 3, output = nameResult("workspace", name, spatial ? ".stl" : ".svg");
      const {setting, options} = readSetting(name);
      const result = await run("workspace", {NAME: name, "--gap": gap, "--output": [output], ...options});
      if (!result || result.state !== "done") return;
      if (spatial && result.code === 0) await showSurface(name, output, setting);
    }
  }
}

// Draw a binary STL on a machine's page, as of the setting for which it was made.
async function showSurface(name, file, setting) {
  const view = new DataView(await (await fetchResult(file)).arrayBuffer());
  const corners = new Float32Array(9 * view.getUint32(80, true));
  for (let i = 0; i < corners.length; i++) corners[i] = view.getFloat32(84 + 50 * Math.floor(i / 9) + 12 + 4 * (i % 9), true);
  pageOf(name)?.showSurface(corners, setting);
}

// The largest box that is proved to lie inside, drawn on each machine's page.
async function findBox() {
  for (const name of chosenMachines()) {
    const output = nameResult("box", name, ".json"), {setting, options} = readSetting(name);
    const result = await run("workspace", {NAME: name, "--box": true, "--output": [output], ...options});
    if (!result || result.code !== 0) continue;
    const box = (await (await fetchResult(output)).json()).box_inside;
    if (box) pageOf(name)?.showBox(box.low, box.high, setting);
  }
}

async function compareMachines() {
  const names = [];
  for (const name of chosenMachines()) names.push(await saveSized(name));
  await run("compare", {NAMES: names, "--part": element("part").value, "--output": "compared.html"});
}

// The name by which a machine is read as it is shown: where sizes were dragged, of its file with these in it.
async function saveSized(name) {
  if (!Object.keys(readSizes(name)).length) return name;
  const sized = nameResult("sized", name, ".yaml");
  await ask(inSession(`files/${escapeName(sized)}`), {method: "PUT", body: await readMachineFile(name)});
  return sized;
}

async function exportToLinuxcnc() {
  for (const name of chosenMachines()) await run("linuxcnc", {NAME: name, "--output": nameResult("linuxcnc", name), ...readSizes(name)});
}

// The atlas of each machine, with its picture, and 1/condition number drawn on its page.
async function drawAtlas() {
  for (const name of chosenMachines()) {
    const folder = nameResult("atlas", name), {setting, options} = readSetting(name);
    const result = await run("atlas", {NAME: name, "--output": folder, ...options});
    const table = state.files.find(file => file.name.startsWith(`${folder}/`) && file.name.endsWith(".csv"));
    if (result && result.code === 0 && table) showTable(name, await (await fetchResult(table.name)).text(), setting);
  }
}

// Draw the places of an atlas' table that are allowed, by 1/condition number.
function showTable(name, text, setting) {
  const page = pageOf(name), lines = text.trim().split("\n").map(line => line.split(",")), head = lines.shift();
  if (!page || !lines.length) return;
  const columns = page.machine.axes.map(axis => head.findIndex(title => title.startsWith(`${axis.name} [`)));
  const [allowed, condition] = ["allowed", "condition number"].map(title => head.indexOf(title));
  const rows = lines.filter(line => line[allowed] === "1");
  const poses = rows.map(line => columns.map((column, i) => +line[column] * (page.machine.axes[i].unit === "rad" ? Math.PI / 180 : 1)));
  const first = [...new Set(lines.map(line => +line[columns[0]]))].sort((a, b) => a - b);
  const step = Math.min(...first.slice(1).map((value, i) => value - first[i]));
  page.showValues(poses, rows.map(line => 1 / +line[condition] || 0), step, "1/condition number", setting);
}
