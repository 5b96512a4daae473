// Zero-mean normalised cross-correlation of every left pixel with every disparity, by running sums: O(1) a pixel and
// disparity whatever the window. Vectorised over disparities: the right row is reversed, so that they are contiguous.
#include "stereo/lanes.inl"

// out[q] = row[left_width - 1 - q - d_min], 0 outside.
static void reverse_row(const CoarseBand& b, const float* row, float* out) {
  const int length = b.left_width + b.d_count;
  for (int q = 0; q < length; ++q) {
    const int x = b.left_width - 1 - q - b.d_min;
    out[q] = x >= 0 && x < b.right_width ? row[x] : 0;
  }
}

// columns[x][k] += sign * L(x) R(x - d_min - k) for one row.
static void add_column(const CoarseBand& b, int x, float l, const float* reversed) {
  float* c = b.columns + (long)x * b.d_count;
  const float* r = reversed + b.left_width - 1 - x;
  for (int k = 0; k < b.d_count; k += 8) store8(c + k, load8(c + k) + l * load8(r + k));
}

static void best_of_row(const CoarseBand& b, int x, int y, float* correlation, const float* sums, const float* mean_r,
                        const float* norm_r, float* best_r, float* arg_r) {
  const long i = (long)y * b.left_width + x;
  const float n = (float)((2 * b.half + 1) * (2 * b.half + 1)), nm = n * b.left_mean[i], norm = b.left_norm[i];
  const int q = b.left_width - 1 - x;
  Lanes top = all(-2), at = all(0), index = {0, 1, 2, 3, 4, 5, 6, 7};
  for (int k = 0; k < b.d_count; k += 8, index += 8.F) {
    const Lanes c = (load8(sums + k) - nm * load8(mean_r + q + k)) * norm * load8(norm_r + q + k);
    store8(correlation + k, c);
    const IntLanes better = c > top;
    top = (Lanes)(((IntLanes)c & better) | ((IntLanes)top & ~better));
    at = (Lanes)(((IntLanes)index & better) | ((IntLanes)at & ~better));
    const Lanes old = load8(best_r + q + k);
    const IntLanes gain = c > old;
    store8(best_r + q + k, (Lanes)(((IntLanes)c & gain) | ((IntLanes)old & ~gain)));
    store8(arg_r + q + k, (Lanes)(((IntLanes)index & gain) | ((IntLanes)load8(arg_r + q + k) & ~gain)));
  }
  int best = 0;
  for (int l = 1; l < 8; ++l)
    if (top[l] > top[best] || (top[l] == top[best] && at[l] < at[best])) best = l;
  const int k = (int)at[best];
  float offset = 0;
  if (k > 0 && k < b.d_count - 1) {
    const float before = correlation[k - 1], after = correlation[k + 1], bend = before + after - 2 * top[best];
    if (bend < 0) offset = 0.5F * (before - after) / bend;
  }
  Lanes other = all(-2), far = Lanes{0, 1, 2, 3, 4, 5, 6, 7} - (float)k;
  for (int q8 = 0; q8 < b.d_count; q8 += 8, far += 8.F) {
    const Lanes c = load8(correlation + q8);
    const IntLanes more = (c > other) & ((far > 2.5F) | (far < -2.5F));
    other = (Lanes)(((IntLanes)c & more) | ((IntLanes)other & ~more));
  }
  float second = other[0];
  for (int l = 1; l < 8; ++l) second = other[l] > second ? other[l] : second;
  b.second_left[i] = second;
  b.best_left[i] = top[best];
  b.disparity_left[i] = (float)(b.d_min + k) + offset;
}

void coarse_band(const CoarseBand& b) {
  const int length = b.left_width + b.d_count, h = b.half;
  float *enter = b.reversed, *leave = enter + length, *mean_r = leave + length, *norm_r = mean_r + length;
  float *best_r = norm_r + length, *arg_r = best_r + length;
  float *sums = b.sums, *correlation = b.sums + b.d_count;
  for (long i = 0; i < (long)b.left_width * b.d_count; ++i) b.columns[i] = 0;
  for (int y = b.row_begin - h; y < b.row_begin + h; ++y) {
    reverse_row(b, b.right + (long)y * b.right_width, enter);
    for (int x = 0; x < b.left_width; ++x) add_column(b, x, b.left[(long)y * b.left_width + x], enter);
  }
  for (int y = b.row_begin; y < b.row_end; ++y) {
    reverse_row(b, b.right + (long)(y + h) * b.right_width, enter);
    const int gone = y - h - 1;
    if (y > b.row_begin) reverse_row(b, b.right + (long)gone * b.right_width, leave);
    reverse_row(b, b.right_mean + (long)y * b.right_width, mean_r);
    reverse_row(b, b.right_norm + (long)y * b.right_width, norm_r);
    for (int q = 0; q < length; ++q) best_r[q] = -2, arg_r[q] = 0;
    for (int k = 0; k < b.d_count; ++k) sums[k] = 0;
    for (int x = 0; x < b.left_width; ++x) {
      add_column(b, x, b.left[(long)(y + h) * b.left_width + x], enter);
      if (y > b.row_begin) add_column(b, x, -b.left[(long)gone * b.left_width + x], leave);
      const float* in = b.columns + (long)x * b.d_count;
      if (x <= 2 * h) {
        for (int k = 0; k < b.d_count; k += 8) store8(sums + k, load8(sums + k) + load8(in + k));
      } else {
        const float* out = in - (long)(2 * h + 1) * b.d_count;
        for (int k = 0; k < b.d_count; k += 8) store8(sums + k, load8(sums + k) + (load8(in + k) - load8(out + k)));
      }
      // The window that ends at x is centred on x - h.
      const int centre = x - h;
      if (centre < h || b.left_norm[(long)y * b.left_width + centre] <= 0) continue;
      best_of_row(b, centre, y, correlation, sums, mean_r, norm_r, best_r, arg_r);
    }
    for (int q = 0; q < length; ++q) {
      const int x = b.left_width - 1 - q - b.d_min;
      if (x < 0 || x >= b.right_width) continue;
      b.best_right[(long)y * b.right_width + x] = best_r[q];
      b.disparity_right[(long)y * b.right_width + x] = b.d_min + (int)arg_r[q];
    }
  }
}
