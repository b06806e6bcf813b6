/** The artificial potential on one layer (docs/potential.md), with the planner's default gains. */

export const GAINS = {kAttr: 1, kRep: 1, sigma: 0.3, reach: 1, kMobile: 1, sigmaMobile: 0.5, reachMobile: 2};

const kernel = (k, sigma, d) => (k / (sigma * Math.sqrt(2 * Math.PI))) * Math.exp(-((d / sigma) ** 2) / 2);

/** Squared distances along one row: the lower envelope of parabolas (Felzenszwalb and Huttenlocher 2012). */
function envelope(f, n, out, places, bounds) {
  let k = 0;
  places[0] = 0;
  bounds[0] = -Infinity;
  bounds[1] = Infinity;
  for (let q = 1; q < n; ++q) {
    let s;
    do {
      const p = places[k];
      s = (f[q] + q * q - f[p] - p * p) / (2 * (q - p));
    } while (s <= bounds[k] && --k >= 0);
    ++k;
    places[k] = q;
    bounds[k] = s;
    bounds[k + 1] = Infinity;
  }
  for (let q = 0, j = 0; q < n; ++q) {
    while (bounds[j + 1] < q) ++j;
    out[q] = (q - places[j]) ** 2 + f[places[j]];
  }
}

/**
 * Squared distance in voxels from each cell of a layer to the nearest occupied voxel, exact up to `reach` voxels above and below.
 * @param {(x: number, y: number, z: number) => boolean} occupied
 */
export function layerDistances(size, layer, reach, occupied) {
  const FAR = 1e9;
  const [nx, ny, nz] = size;
  const d = new Float64Array(nx * ny).fill(FAR);
  for (let z = Math.max(0, layer - reach); z <= Math.min(nz - 1, layer + reach); ++z) {
    const dz = (z - layer) ** 2;
    for (let y = 0; y < ny; ++y) {
      for (let x = 0; x < nx; ++x) {
        if (dz < d[y * nx + x] && occupied(x, y, z)) d[y * nx + x] = dz;
      }
    }
  }
  const longest = Math.max(nx, ny);
  const [line, out] = [new Float64Array(longest), new Float64Array(longest)];
  const [places, bounds] = [new Int32Array(longest), new Float64Array(longest + 1)];
  for (let y = 0; y < ny; ++y) {
    for (let x = 0; x < nx; ++x) line[x] = d[y * nx + x];
    envelope(line, nx, out, places, bounds);
    for (let x = 0; x < nx; ++x) d[y * nx + x] = out[x];
  }
  for (let x = 0; x < nx; ++x) {
    for (let y = 0; y < ny; ++y) line[y] = d[y * nx + x];
    envelope(line, ny, out, places, bounds);
    for (let y = 0; y < ny; ++y) d[y * nx + x] = out[y];
  }
  return d;
}

/** Attraction of the goal, repulsion of the nearest obstacle, and the fellows' kernels. @returns the value at a point */
export function potentialAt(point, obstacle_m, goal, fellows, gains = GAINS) {
  const distance = other => Math.hypot(point[0] - other[0], point[1] - other[1], point[2] - other[2]);
  let value = goal ? gains.kAttr * distance(goal) : 0;
  if (obstacle_m < gains.reach) value += kernel(gains.kRep, gains.sigma, obstacle_m);
  for (const fellow of fellows) {
    const d = distance(fellow);
    if (d < gains.reachMobile) value += kernel(gains.kMobile, gains.sigmaMobile, d);
  }
  return value;
}
