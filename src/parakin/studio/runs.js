"use strict";
// Runs of commands: begun, followed to their end, and shown with what they printed and wrote.

// How many letters a line of a run's output has in the panel.
function countColumns() {
  const shown = make("pre", {textContent: "0".repeat(100)}), box = make("div", {className: "run"}, shown);
  Object.assign(shown.style, {whiteSpace: "pre", width: "max-content"});
  element("runs").append(box);
  const {width} = shown.getBoundingClientRect(), {paddingLeft, paddingRight} = getComputedStyle(shown);
  const padding = parseFloat(paddingLeft) + parseFloat(paddingRight), columns = Math.floor(100 * (box.clientWidth - padding) / (width - padding));
  box.remove();
  return Math.min(1000, Math.max(20, columns));
}

async function beginRun(command, values) {
  const {run, line} = await ask(inSession("runs"), {method: "POST", body: JSON.stringify({command, values, columns: countColumns()})});
  return {number: run, line};
}

async function followRun(number, tell = () => {}) {
  for (let wait = 0.1; ; wait = Math.min(1, 1.5 * wait)) {
    const run = await ask(inSession(`runs/${number}`));
    tell(run);
    if (run.state !== "waiting" && run.state !== "running") return run;
    await pause(wait);
  }
}

function showRun(number, line) {
  const status = make("span", {className: "state", textContent: "waiting"});
  const output = make("pre", {textContent: "", hidden: true});
  const cancel = make("button", {textContent: "Cancel", type: "button"});
  const again = make("button", {textContent: "Copy", type: "button"});
  const box = make("details", {className: "run", open: true}, make("summary", {}, make("code", {textContent: line}), " ", status), output,
    make("p", {className: "row"}, cancel, again));
  box.dataset.run = number;
  cancel.onclick = () => ask(inSession(`runs/${number}`), {method: "DELETE"});
  again.onclick = () => navigator.clipboard.writeText(line);
  element("runs").prepend(box);
  return run => {
    const over = run.state !== "waiting" && run.state !== "running";
    const good = run.state === "done" && run.code === 0;
    status.textContent = `${run.state === "done" ? `exit ${run.code}` : run.state}, ${run.seconds.toFixed(1)} s`;
    status.className = `state ${good ? "done" : over ? "bad" : ""}`;
    output.replaceChildren(run.output, make("span", {className: "bad", textContent: run.errors}));
    output.hidden = !(run.output || run.errors);
    cancel.hidden = over;
  };
}

// Links to the files that a run wrote, and its pictures.
function showResults(number, before) {
  const written = new Map(before.map(file => [file.name, file.written]));
  const made = state.files.filter(file => written.get(file.name) !== file.written && !file.name.startsWith("page_"));
  const box = element("runs").querySelector(`[data-run="${number}"]`);
  const folders = new Set(made.filter(file => file.name.includes("/")).map(file => file.name.split("/")[0]));
  box.append(...[...folders].map(folder => make("p", {className: "result"},
    make("a", {href: inSession(`packed/${escapeName(folder)}.zip`), textContent: `${folder}.zip, all of these`}))));
  box.append(...made.map(file => {
    const href = inSession(`files/${escapeName(file.name)}`), link = make("a", {href, target: "_blank", rel: "noopener", textContent: file.name});
    if (!/\.(svg|png)$/i.test(file.name)) return make("p", {className: "result"}, link);
    return make("p", {className: "result"}, link, make("img", {src: `${href}?${file.written}`, alt: file.name}));
  }));
}

async function run(command, values) {
  try {
    const before = state.files;
    const {number, line} = await beginRun(command, values);
    const result = await followRun(number, showRun(number, line));
    await refreshFiles();
    showResults(number, before);
    return result;
  } catch (error) {
    element("runs").prepend(make("p", {className: "bad state", textContent: error.message}));
    return null;
  }
}
