// Names in the picture: drives at their struts, and the axes of the frame in which poses are given.

const AXIS_COLOURS = ["#d13a34", "#2f8f3a", "#2a6fd0"], labels = [];

function addLabel(texts, place, axis = null) {
  const span = document.createElement("span");
  span.append(...texts);
  if (axis) {
    span.className = "axis";
    span.style.color = `var(--${axis.toLowerCase()})`;
  }
  overlay.append(span);
  labels.push({span, place, axis: axis !== null});
}

const itemOf = joint => machine.items.findIndex(item => item.name === joint.name && item.kind !== "rail");
machine.joints.forEach(joint => {
  const number = itemOf(joint);
  if (number < 0) return;
  // What moves the same strut without a body of its own is named with it, at the leg's first one.
  const leg = machine.joints.filter(other => joint.leg >= 0 && other.leg === joint.leg), isFirst = leg.find(other => itemOf(other) >= 0) === joint;
  const names = isFirst ? leg.filter(other => other === joint || itemOf(other) < 0) : [joint];
  const points = itemPoints[number], share = machine.items[number].kind === "telescope" ? 0.5 : 0;
  addLabel(names.flatMap((own, i) => [...(i ? [", "] : []), makeName(own, number)]), into => into.lerpVectors(points[0], points[points.length - 1], share));
});

// Turns of a head are named at the tool.
const ofHead = machine.joints.filter(joint => joint.leg < 0 && itemOf(joint) < 0), toolNumber = machine.items.findIndex(item => item.kind === "tool");
if (ofHead.length && toolNumber >= 0) {
  const points = itemPoints[toolNumber];
  addLabel(ofHead.flatMap((own, i) => [...(i ? [", "] : []), makeName(own, toolNumber)]), into => into.lerpVectors(points[0], points[1], 0.3));
}

// A drive's name, by which its strut is taken where another one lies over it in the picture.
function makeName(joint, item) {
  const name = document.createElement("b");
  name.textContent = joint.name;
  name.dataset.drive = machine.joints.indexOf(joint);
  name.dataset.item = item;
  return name;
}

const triad = new THREE.Group();
["X", "Y", "Z"].forEach((letter, i) => {
  const unit = new THREE.Vector3().setComponent(i, 1);
  if (machine.normal && abs(machine.normal[i]) > 0.999) return;
  const arrow = new THREE.ArrowHelper(unit, new THREE.Vector3(), 0.085 * size, AXIS_COLOURS[i], 0.02 * size, 0.011 * size);
  triad.add(arrow);
  addLabel([letter], into => into.copy(unit).multiplyScalar(0.1 * size).applyMatrix4(frame), letter);
});
workGroup.add(triad);

const labelPlace = new THREE.Vector3(), LINE = 13; // px

// The first place from y downwards that is clear of the labels already placed.
function findClear(x, y, width, taken) {
  const beside = taken.filter(other => abs(x - other.x) < 0.5 * (width + other.width) + 2).sort((one, other) => one.y - other.y);
  for (const other of beside) if (abs(y - other.y) < LINE) y = other.y + LINE;
  taken.push({x, y, width});
  return y;
}

function placeLabels() {
  const taken = [];
  const shown = document.getElementById("labels").checked, {clientWidth: width, clientHeight: height} = canvas;
  for (const {span, place, axis} of labels) {
    place(labelPlace).project(camera);
    const seen = (shown || axis) && labelPlace.z < 1 && abs(labelPlace.x) < 1 && abs(labelPlace.y) < 1;
    span.style.display = seen ? "" : "none";
    if (!seen) continue;
    const x = (0.5 + 0.5 * labelPlace.x) * width + (axis ? -5 : 9);
    const y = findClear(x, (0.5 - 0.5 * labelPlace.y) * height - (axis ? 9 : 20), 7 * span.textContent.length, taken);
    span.style.transform = `translate(${x.toFixed(1)}px, ${y.toFixed(1)}px)`;
  }
}

let pictureRequested = false, pictureCount = 0;

// Draw the picture anew, once for all that changes before it.
function requestPicture() {
  if (pictureRequested) return;
  pictureRequested = true;
  requestAnimationFrame(() => {
    pictureRequested = false;
    render();
    placeLabels();
    pictureCount += 1;
  });
}
