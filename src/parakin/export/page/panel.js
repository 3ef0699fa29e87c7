// The panel beside the picture: sliders for pose and joints, limits, modes, singularities.

const panel = document.getElementById("panel"), DEGREE = PI / 180;
const factorOf = unit => unit === "rad" ? 1 / DEGREE : 1;
const signOf = unit => ({rad: "°", "1": "", mm: "mm", "mm²": "mm²"})[unit];
const formatValue = (value, unit) => Number.isFinite(value)
  ? `${(value * factorOf(unit)).toFixed(unit === "1" ? 3 : 2)}${unit === "mm" ? " mm" : signOf(unit)}` : "–";

function makeElement(tag, attributes = {}, ...children) {
  const element = Object.assign(document.createElement(tag), attributes);
  element.append(...children);
  return element;
}

function addSection(title) {
  const section = makeElement("section", {}, makeElement("h2", {textContent: title}));
  panel.append(section);
  return section;
}

const FARTHEST = 4; // of a slider's length: beyond its ends no number is taken

// A slider with its number, in the unit that people read; calls change with the value in mm or rad.
function addSlider(section, {name, unit, low, high}, change) {
  const factor = factorOf(unit), dot = makeElement("i"), step = unit === "rad" ? 0.01 : 0.001;
  const range = makeElement("input", {type: "range", min: low * factor, max: high * factor, step: (high - low) * factor / 2000});
  const number = makeElement("input", {type: "number", step: "any"});
  for (const input of [range, number]) {
    input.setAttribute("aria-label", unit === "1" ? name : `${name}, ${unit === "rad" ? "degrees" : unit}`);
    input.addEventListener(input === range ? "input" : "change", () => {
      const value = input.valueAsNumber / factor, farthest = FARTHEST * (high - low);
      if (value > low - farthest && value < high + farthest) change(value);
      else setState(current, `${name}: ${Number.isFinite(value) ? "beyond what is shown" : "a number expected"}`);
    });
  }
  section.append(makeElement("div", {className: "row"}, makeElement("b", {title: name}, dot, name), range, number,
    makeElement("span", {textContent: signOf(unit)})));
  return {
    dot,
    show(value) {
      const shown = value * factor, text = String(Math.round(shown / step) * step);
      range.value = shown;
      if (document.activeElement !== number || stoppedBy !== null) number.value = Number(text).toFixed(2);
    },
  };
}

const poseSection = addSection("Tool pose");
const poseSliders = machine.axes.map((axis, i) => addSlider(poseSection, axis,
  value => moveToPose(current.pose.map((old, j) => j === i ? value : old))));

const jointSection = addSection("Joints");
const homeJoints = model.inverse(everyHome(), machine.mode);
const jointSliders = machine.joints.map((joint, i) => {
  const reach = joint.unit === "rad" ? PI : 0.5 * size, low = joint.low ?? homeJoints[i] - reach, high = joint.high ?? homeJoints[i] + reach;
  const wider = 0.08 * (high - low);
  return addSlider(jointSection, {...joint, low: low - wider, high: high + wider},
    value => moveToJoints(current.joints.map((old, j) => j === i ? value : old)));
});

const sizeSliders = path ? [] : buildSizeSliders();

function buildSizeSliders() {
  if (!machine.sizes.length && !machine.fixedSizes.length) return [];
  const section = addSection("Sizes");
  const sliders = machine.sizes.map(({name, unit, nominal}, i) => {
    const reach = 0.4 * abs(nominal) || (unit === "rad" ? 0.2 : 0.05 * size);
    return addSlider(section, {name, unit, low: nominal - reach, high: nominal + reach}, value => moveToSizes(followSize(i, value)));
  });
  const notes = ["The file's sizes; the pose is held."];
  if (machine.sizes.some(({follows}) => follows.some(rate => rate !== 0))) notes.push("One that the file calculates from another follows it.");
  if (machine.fixedSizes.length) notes.push(`Only in the file, for the machine follows them neither evenly nor as a turn, or not in closed form: ${machine.fixedSizes.join(", ")}.`);
  section.append(...notes.map(textContent => makeElement("p", {className: "note", textContent})));
  if (sliders.length) section.append(makeElement("button", {id: "sizes", textContent: "As in the file", onclick: () => moveToSizes(nominalSizes)}));
  return sliders;
}

const limitSection = addSection("Nearest limits");
const limitList = makeElement("div"), allLimits = makeElement("div");
limitSection.append(limitList, makeElement("details", {}, makeElement("summary", {textContent: `all ${machine.limits.length} limits`}), allLimits));
const NEAREST = 5;

function makeGauge(place) {
  const name = makeElement("b"), fill = makeElement("i"), value = makeElement("span");
  const row = makeElement("div", {className: "gauge"}, name, makeElement("div", {}, fill), value);
  place.append(row);
  return (text, share, shown, title = "") => {
    row.className = `gauge ${share <= 0 ? "bad" : share < 0.5 ? "near" : ""}`;
    name.textContent = text;
    row.title = title;
    fill.style.width = `${100 * max(0, min(1, share))}%`;
    value.textContent = shown;
  };
}

const nearestGauges = Array.from({length: min(NEAREST, machine.limits.length)}, () => makeGauge(limitList));
const limitGauges = machine.limits.map(() => makeGauge(allLimits));

function showLimit(gauge, i, margin) {
  const {name, subject, unit, side, bound} = machine.limits[i], own = side === "max" ? bound - margin : bound + margin;
  const sign = side === "max" ? "≤" : "≥", end = Number((bound * factorOf(unit)).toFixed(2));
  const value = side === "reach" ? margin >= 0 ? "reaches" : "out of reach"
    : `${Number.isFinite(own) ? (own * factorOf(unit)).toFixed(1) : "–"} ${sign} ${end}${unit === "rad" ? "°" : ""}`;
  const title = side === "reach" ? `${subject} must close` : `${subject}: ${formatValue(own, unit)}, at ${side === "max" ? "most" : "least"} ${formatValue(bound, unit)}`;
  gauge(name, margin >= 0 ? max(1e-3, rateMargin(margin, i)) : 0, value, title);
}

const modeSection = addSection("Modes");
const signButtons = machine.mode.map((_, i) => makeElement("button", {onclick: () => switchSign(i), disabled: machine.fixed_signs.includes(i), title: `the other solution of ${machine.signs[i]}`}));
if (signButtons.length) modeSection.append(makeElement("p", {className: "note", textContent: "Working mode: press to switch a branch."}), makeElement("div", {className: "buttons"}, ...signButtons));
const assemblyNote = makeElement("p", {className: "note"});
modeSection.append(makeElement("p", {className: "note", textContent: "Assembly: another pose of the same joints."}),
  makeElement("div", {className: "buttons"}, makeElement("button", {id: "assembly", textContent: "Next assembly", onclick: () => showNextAssembly()})), assemblyNote);

const singularSection = addSection("Singularity");
const singularGauge = makeGauge(singularSection), singularNote = makeElement("p", {className: "note"});
singularSection.append(singularNote);

function updatePanel(margins) {
  machine.axes.forEach((_, i) => poseSliders[i].show(current.pose[i]));
  machine.joints.forEach((_, i) => jointSliders[i].show(current.joints[i]));
  sizeSliders.forEach((slider, i) => slider.show(model.sizes[i]));
  const rates = margins.map((margin, i) => margin >= 0 ? rateMargin(margin, i) : -1);
  const order = [...rates.keys()].sort((a, b) => rates[a] - rates[b] || a - b);
  nearestGauges.forEach((gauge, k) => showLimit(gauge, order[k], margins[order[k]]));
  limitGauges.forEach((gauge, i) => showLimit(gauge, i, margins[i]));
  machine.joints.forEach((_, drive) => {
    const own = rates.filter((_, i) => machine.limits[i].joints.includes(drive)), level = min(1, ...own);
    colourDrive(drive, max(0, level), level < 0);
    jointSliders[drive].dot.style.background = level < 0 ? "var(--bad)" : level < 0.5 ? "var(--near)" : "var(--good)";
  });
  signButtons.forEach((button, i) => {
    button.textContent = `${machine.signs[i]} ${current.signs[i] > 0 ? "+" : "−"}`;
    button.setAttribute("aria-pressed", current.signs[i] !== machine.mode[i]);
  });
  const known = assemblies.includes(current);
  assemblyNote.textContent = known ? `${assemblyNumber + 1} of ${assemblies.length} that a search found` : "";
  const share = singularity.share;
  singularGauge("det A", abs(share) < 0.02 ? 0 : min(1, abs(share)), `${(100 * share).toFixed(1)} %`, "the determinant over home's; 0 at a parallel singularity");
  singularNote.textContent = share < 0 ? "Beyond a parallel singularity: another assembly than home's."
    : freeMotion.visible ? "The violet arrow is the motion that the drives hardly hold." : "Of home's. 0 where the tool moves though the drives stand.";
  showVerdict(margins, rates);
}

function showVerdict(margins, rates) {
  const verdict = document.getElementById("verdict"), broken = margins.flatMap((margin, i) => margin >= 0 ? [] : [nameLimit(i)]);
  const near = rates.some(rate => rate < 0.5);
  verdict.className = broken.length || stoppedBy ? "bad" : near ? "near" : "";
  verdict.textContent = unreached ? `Out of reach: ${stoppedBy}; the machine stays behind` : broken.length ? `Off limits: ${broken.slice(0, 4).join(", ")}${broken.length > 4 ? " and others" : ""}`
    : stoppedBy ? `Stopped: ${stoppedBy}` : near ? "Allowed, near a limit" : "Allowed";
}
