// The player below the picture: time, colours, offences, and the joints' curves with a cursor.

const CURVE_COLOURS = ["#2f6fb3", "#d1701a", "#2b8a4b", "#8a4fbf", "#b3372f", "#2a8d93", "#8a6d1f", "#c2478f"];
const footer = document.getElementById("player"), curves = makeElement("canvas", {id: "curves", height: 96, tabIndex: 0});
const playButton = makeElement("button", {id: "play", textContent: "▶ Play"});
const timeSlider = makeElement("input", {type: "range", id: "time", min: 0, step: "any", value: 0});
const timeText = makeElement("output", {id: "clock"}), legend = makeElement("span", {className: "legend"});
const speedChoice = makeElement("select", {id: "speed"}, ...[1, 4, 16, 64].map(factor => makeElement("option", {value: factor, textContent: `${factor}×`})));
const colourChoice = makeElement("select", {id: "colours"});
let lastTick = 0;

function buildPlayer() {
  footer.hidden = false;
  timeSlider.max = path.end;
  timeSlider.setAttribute("aria-label", path.timed ? "time, s" : "record");
  speedChoice.setAttribute("aria-label", "speed of playing");
  curves.setAttribute("aria-label", "Joints over time, each over its drive's range; arrow keys step");
  const kinds = [["margin", "least margin"], ["feed", "feed"], ...path.timed ? [["pace", "what sets the pace"]] : [], ["motion", "feed or rapid"]];
  colourChoice.append(...kinds.map(([value, textContent]) => makeElement("option", {value, textContent})));
  colourChoice.setAttribute("aria-label", "colour of the path");
  footer.append(makeElement("div", {className: "controls"}, playButton, timeSlider, timeText, speedChoice, makeElement("label", {textContent: "path by "}, colourChoice), legend), curves);
  workGroup.add(pathLine, offenceDots);
  playButton.onclick = () => setPlaying(!player.playing);
  timeSlider.oninput = () => { setPlaying(false); seek(timeSlider.valueAsNumber); };
  speedChoice.onchange = () => { player.speed = Number(speedChoice.value); };
  colourChoice.onchange = () => { player.colours = colourChoice.value; drawPath(); drawLegend(); };
  curves.addEventListener("pointerdown", event => { setPlaying(false); seekInCurves(event); });
  curves.addEventListener("pointermove", event => { if (event.buttons) seekInCurves(event); });
  curves.addEventListener("keydown", event => {
    const step = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    if (step) seek(pathColumns.times[max(0, min(path.samples - 1, findSample(player.time) + step))]);
  });
  buildOffences();
  drawPath();
  drawLegend();
  listeners.push(drawCurves);
  stopPlaying = () => { if (player.playing) setPlaying(false); };
}

function buildOffences() {
  const section = addSection("Path");
  section.append(makeElement("p", {className: "note", textContent: `${path.source}: ${path.records} records${path.timed ? `, ${formatTime(path.end)}` : ", not timed"}.`}));
  if (!path.offences.length) section.append(makeElement("p", {className: "note", textContent: "It keeps every limit."}));
  else section.append(makeElement("p", {className: "note", textContent: "The worst place of each limit that it breaks:"}));
  for (const {text, sample} of path.offences) {
    section.append(makeElement("button", {className: "offence", textContent: text, onclick: () => { setPlaying(false); seek(pathColumns.times[sample]); }}));
  }
  panel.prepend(section);
}

function formatTime(seconds) {
  const tenths = Math.round(10 * seconds), minutes = Math.floor(tenths / 600);
  return minutes ? `${minutes} min ${((tenths - 600 * minutes) / 10).toFixed(1)} s` : `${seconds.toFixed(2)} s`;
}

function setPlaying(playing) {
  player.playing = playing;
  playButton.textContent = playing ? "❚❚ Pause" : "▶ Play";
  if (!playing) return;
  if (player.time >= path.end) player.time = 0;
  lastTick = performance.now();
  requestAnimationFrame(tick);
}

function tick(now) {
  if (!player.playing) return;
  const rate = path.timed ? 1 : path.end / 20; // records: the whole path in 20 s
  seek(player.time + max(0, now - lastTick) / 1000 * player.speed * rate);
  lastTick = now;
  if (player.time >= path.end) setPlaying(false);
  else requestAnimationFrame(tick);
}

function seekInCurves(event) {
  const box = curves.getBoundingClientRect();
  seek((event.clientX - box.left) / box.width * path.end);
}

const shareOfRange = (joint, q) => joint.low === null || joint.high === null ? 0.5 : (q - joint.low) / (joint.high - joint.low);

// The least and the greatest share of its range that a joint has on the path, or the range's ends.
function findCurveBounds() {
  let low = 0, high = 1;
  machine.joints.forEach((joint, j) => {
    for (let i = j; i < pathColumns.joints.length; i += machine.joints.length) {
      const share = shareOfRange(joint, pathColumns.joints[i]);
      if (share < low) low = share;
      if (share > high) high = share;
    }
  });
  return [low, high];
}

// Each joint over its drive's range, whose ends are the dashed lines; off limits it is beyond them.
let curveBounds = null;
function drawCurves() {
  const {clientWidth: width, clientHeight: height} = curves, ratio = window.devicePixelRatio || 1, styles = getComputedStyle(document.documentElement);
  curves.width = width * ratio;
  curves.height = height * ratio;
  const pen = curves.getContext("2d"), [low, high] = curveBounds ??= findCurveBounds();
  const yOf = share => height - 14 - (share - low) / (high - low) * (height - 28), xOf = time => path.end > 0 ? time / path.end * width : 0;
  pen.scale(ratio, ratio);
  pen.fillStyle = styles.getPropertyValue("--ink");
  pen.strokeStyle = styles.getPropertyValue("--bad");
  pen.setLineDash([4, 4]);
  for (const share of [0, 1]) strokeLine(pen, [[0, yOf(share)], [width, yOf(share)]]);
  pen.setLineDash([]);
  const stride = max(1, Math.floor(path.samples / (2 * width)));
  let nameLeft = 4;
  machine.joints.forEach((joint, j) => {
    const points = [];
    for (let i = 0; i < path.samples; i += stride) points.push([xOf(pathColumns.times[i]), yOf(shareOfRange(joint, pathColumns.joints[i * machine.joints.length + j]))]);
    pen.strokeStyle = CURVE_COLOURS[j % CURVE_COLOURS.length];
    strokeLine(pen, points);
    pen.lineWidth = 3;
    strokeLine(pen, [[nameLeft, 6.5], [nameLeft + 10, 6.5]]);
    pen.lineWidth = 1;
    pen.fillText(joint.name, nameLeft + 13, 10);
    nameLeft += 13 + max(31, pen.measureText(joint.name).width + 14);
  });
  pen.strokeStyle = styles.getPropertyValue("--ink");
  strokeLine(pen, [[xOf(player.time), 0], [xOf(player.time), height]]);
  showClock();
}

function strokeLine(pen, points) {
  pen.beginPath();
  points.forEach(([x, y], i) => { // it is broken where a value is none
    if (Number.isFinite(y)) pen[i && Number.isFinite(points[i - 1][1]) ? "lineTo" : "moveTo"](x, y);
  });
  pen.stroke();
}

function showClock() {
  const i = findSample(player.time), {feed, binding, lines} = pathColumns;
  timeSlider.value = player.time;
  const pace = path.timed ? `, ${feed[i].toFixed(0)} mm/min, by ${path.bindings[binding[i]]?.name ?? "–"}` : "";
  timeText.textContent = `${path.timed ? formatTime(player.time) : `record ${Math.round(player.time)}`}, line ${lines[i]}${pace}`;
}

const makeKey = (name, colour) => makeElement("b", {}, makeElement("i", {style: `background: ${colour}`}), name);

function drawLegend() {
  const most = {margin: greatestOf("margins", 0.05), feed: greatestOf("feed", 1e-6)};
  legend.replaceChildren();
  if (player.colours === "pace") {
    const used = [...new Set(pathColumns.binding)].filter(Number.isFinite).slice(0, 8);
    legend.append(...used.map(number => makeKey(path.bindings[number].name, bindingColour(number))));
  } else if (player.colours === "motion") {
    legend.append(makeKey("feed", "#00897b"), makeKey("rapid", "#90a4ae"));
  } else {
    const end = player.colours === "margin" ? `${(100 * most.margin).toFixed(0)} % of half a range` : `${most.feed.toFixed(0)} mm/min`;
    legend.append("0 ", makeElement("i", {className: "scale"}), ` ${end}`);
  }
}

// Look at the path from near by, as it lies now.
function viewPath() {
  pathLine.geometry.computeBoundingSphere();
  const {center, radius} = pathLine.geometry.boundingSphere;
  orbit.target.copy(center).applyMatrix4(frame);
  orbit.distance = max(0.02 * size, 1.2 * radius / sin(0.5 * camera.fov * PI / 180) / min(1, camera.aspect));
  placeCamera();
  requestPicture();
}

if (path) {
  const button = document.getElementById("part");
  button.hidden = false;
  button.addEventListener("click", viewPath);
  document.addEventListener("keydown", event => {
    if (!event.target.matches("input:not([type=checkbox]), select") && event.key.toLowerCase() === "p") viewPath();
  });
  buildPlayer();
  if (path.offences.length) seek(pathColumns.times[path.offences[0].sample]);
  new ResizeObserver(drawCurves).observe(footer);
}
