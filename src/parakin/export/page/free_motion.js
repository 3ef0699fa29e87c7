// Near a parallel singularity: the motion that the drives do not hold, as a double arrow at the tip and a ring about
// the axis of its turn.

const NEAR_SINGULAR = 0.35; // of home's determinant
const VIOLET = 0x8e24aa, freeMotion = new THREE.Group();
const freeMaterial = new THREE.MeshStandardMaterial({color: VIOLET, transparent: true, roughness: 0.4});
const shaft = new THREE.Mesh(bar, freeMaterial), tips = [-1, 1].map(() => new THREE.Mesh(new THREE.ConeGeometry(1, 2.6, 18), freeMaterial));
const ring = new THREE.Mesh(new THREE.TorusGeometry(1, 0.035, 10, 60), freeMaterial);
freeMotion.add(shaft, ...tips, ring);
scene.add(freeMotion);

const singularity = {share: 1}; // det A over home's

function updateFreeMotion(state) {
  singularity.share = measureSide(state) / (abs(homeSide) > 1e-9 ? homeSide : 1); // of one where home itself is singular
  const nearness = 1 - abs(singularity.share) / NEAR_SINGULAR;
  freeMotion.visible = nearness > 0;
  if (!freeMotion.visible) return;
  const motion = findFreeMotion(state), rotation = new THREE.Matrix3().setFromMatrix4(frame);
  const velocity = new THREE.Vector3(...motion.velocity).applyMatrix3(rotation);
  const turn = new THREE.Vector3(...motion.turn).applyMatrix3(rotation), tip = handle.position;
  freeMaterial.opacity = 0.25 + 0.7 * nearness;
  const moves = velocity.length(), turns = turn.length(), reach = 0.16 * size * moves;
  for (const mesh of [shaft, ...tips]) mesh.visible = moves > 0.05;
  if (moves > 0.05) {
    velocity.normalize();
    const [a, b] = [-1, 1].map(side => tip.clone().addScaledVector(velocity, side * reach));
    placeBar(shaft, a, b, 0.005 * size);
    tips.forEach((cone, i) => {
      cone.position.copy([a, b][i]);
      cone.quaternion.setFromUnitVectors(UP, velocity.clone().multiplyScalar(i ? 1 : -1));
      cone.scale.setScalar(0.013 * size);
    });
  }
  ring.visible = turns > 0.05;
  ring.position.copy(tip);
  ring.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), turn.normalize());
  ring.scale.setScalar(0.11 * size * (0.4 + 0.6 * turns));
}
