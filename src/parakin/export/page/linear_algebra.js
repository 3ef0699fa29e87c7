// Small dense matrices, row by row in one array.

// Solve A x = b of n rows by elimination with pivoting; returns x and det A. Neither A nor b is kept.
function solveLinear(a, b, n) {
  let determinant = 1;
  for (let k = 0; k < n; k++) {
    let pivot = k;
    for (let i = k + 1; i < n; i++) if (abs(a[i * n + k]) > abs(a[pivot * n + k])) pivot = i;
    if (pivot !== k) {
      determinant = -determinant;
      for (let c = 0; c < n; c++) [a[k * n + c], a[pivot * n + c]] = [a[pivot * n + c], a[k * n + c]];
      [b[k], b[pivot]] = [b[pivot], b[k]];
    }
    determinant *= a[k * n + k];
    for (let i = k + 1; i < n; i++) {
      const factor = a[i * n + k] / a[k * n + k];
      for (let c = k + 1; c < n; c++) a[i * n + c] -= factor * a[k * n + c];
      b[i] -= factor * b[k];
    }
  }
  for (let k = n - 1; k >= 0; k--) {
    for (let c = k + 1; c < n; c++) b[k] -= a[k * n + c] * b[c];
    b[k] /= a[k * n + k];
  }
  return {x: b, determinant};
}

// The least squares of A x = b with n columns and as many rows or more; returns x and det A, of a tall A its volume.
function solveLeastSquares(a, b, n) {
  if (b.length === n) return solveLinear(a, b, n);
  const square = multiplyTransposed(a, n), right = new Array(n).fill(0);
  for (let j = 0; j < n; j++) for (let k = 0; k < b.length; k++) right[j] += a[k * n + j] * b[k];
  const {x, determinant} = solveLinear(square, right, n);
  return {x, determinant: sqrt(max(0, determinant))};
}

function multiplyTransposed(a, n) {
  const square = new Array(n * n).fill(0);
  for (let i = 0; i < n; i++) for (let j = 0; j < n; j++) {
    for (let k = 0; k * n < a.length; k++) square[i * n + j] += a[k * n + i] * a[k * n + j];
  }
  return square;
}

function computeDeterminant(a, n) {
  return solveLeastSquares([...a], new Array(a.length / n).fill(0), n).determinant;
}

// The right singular vector of the least singular value of A with n columns, by Jacobi's rotations of AᵀA; its greatest
// component is positive.
function findNullVector(a, n) {
  const m = multiplyTransposed(a, n), v = new Float64Array(n * n);
  for (let i = 0; i < n; i++) v[i * n + i] = 1;
  for (let sweep = 0; sweep < 12; sweep++) {
    for (let p = 0; p < n; p++) for (let q = p + 1; q < n; q++) rotateJacobi(m, v, n, p, q);
  }
  let least = 0;
  for (let i = 1; i < n; i++) if (m[i * n + i] < m[least * n + least]) least = i;
  const vector = Array.from({length: n}, (_, i) => v[i * n + least]);
  const greatest = vector.reduce((best, x) => abs(x) > abs(best) ? x : best, 0);
  return vector.map(x => greatest < 0 ? -x : x);
}

function rotateJacobi(m, v, n, p, q) {
  const off = m[p * n + q];
  if (off === 0) return;
  const theta = (m[q * n + q] - m[p * n + p]) / (2 * off);
  const t = (theta < 0 ? -1 : 1) / (abs(theta) + sqrt(theta * theta + 1)), c = 1 / sqrt(t * t + 1), s = t * c;
  for (let k = 0; k < n; k++) {
    const x = m[k * n + p], y = m[k * n + q];
    m[k * n + p] = c * x - s * y;
    m[k * n + q] = s * x + c * y;
  }
  for (let k = 0; k < n; k++) {
    const x = m[p * n + k], y = m[q * n + k], vx = v[k * n + p], vy = v[k * n + q];
    m[p * n + k] = c * x - s * y;
    m[q * n + k] = s * x + c * y;
    v[k * n + p] = c * vx - s * vy;
    v[k * n + q] = s * vx + c * vy;
  }
}
