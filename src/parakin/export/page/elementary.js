// As in parakin: NaN goes through, and no direction has the angle 0.
const {sin, cos, sqrt, abs, atan2, min, max, hypot, PI} = Math;
const lesser = (x, y) => y !== y ? y : y < x ? y : x;
const greater = (x, y) => y !== y ? y : y > x ? y : x;
const withSign = (x, y) => (y < 0 ? -abs(x) : abs(x)) + 0 * y;
const angleOf = (y, x) => atan2(y + 0, x + 0);
