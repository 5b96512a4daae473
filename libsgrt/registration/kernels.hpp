// The hot loop of registration, compiled once per instruction set from pass_kernel.inl (plain C inside: no inline
// function of a library may leak out of a file that is built for AVX2). The same lanes and the same order of additions
// give the same bits on both. docs/theory/icp.md eq. 1-7.
#pragma once

#include <cstdint>

namespace sgrt::kernels {

// A piece of the reference: a quadric over its tangent plane, in mm about the field's centre. 64 bytes, a cache line.
struct Surfel {
  float q[3];      // a point of the surface
  float n[3];      // its unit outward normal
  float k[6];      // curvature tensor, xx xy xz yy yz zz, 1/mm; K n = 0
  float variance;  // mm2, of one reference sample along n
  float height;    // mm2, what is left of it in the surfel's height
  float reach2;    // mm2: a foot farther than this from q lies past the border; negative: no surfel
  float counts;    // 1: in the ROI, else 0
};

// Slots of a hash table: voxel key to surfel.
struct Slot {
  uint32_t key;  // kNoKey: free
  int32_t surfel;
};
constexpr uint32_t kNoKey = 0xffffffffu;
constexpr int kMaxLevels = 12;
constexpr int kKeyBitsX = 11, kKeyBitsY = 11, kKeyBitsZ = 10;

// One level of the field: voxels of side cell_0 2^level, each with the surfel nearest its middle.
struct LevelView {
  const Slot* slots;  // 2^bits of them
  const Surfel* surfels;
  uint32_t mask;
  int shift;  // 32 - (bits - 3)
};

// What one pass over live points does at a pose: pairs, weights, sums.
struct Pass {
  const float *x, *y, *z;     // live points about their own centre, mm; padded to whole lanes with points far away
  const float *nx, *ny, *nz;  // live normals; null: none
  const float* v;             // live variance along the normal, mm2; null: v_all
  const float* given;         // weights of an earlier pass; null: by the taper
  float v_all;
  float R[9], t[3];                           // to the field's frame
  LevelView level[kMaxLevels];                // the finest wanted first
  int level_count;                            // a voxel that is empty is looked up one level up
  int first;                                  // level[0]'s number in the field
  float low[3], inverse_cell;                 // voxels of the finest level of the field
  float limit;                                // mm: |r| beyond never counts
  float min_cos;                              // of the angle between the normals
  int signs_unsure;                           // take the normals' angle without its sign
  float inverse_scale2, flat, inverse_width;  // taper: 1 up to `flat` sigmas, 0 at flat + width
  int score;                                  // 1: sum for the score's covariance, w^2 v_live / v^2, instead of w / v
  float inverse_lever;
  float *r_out, *w_out;  // out, null allowed: residual (NaN where there is none) and weight
  int32_t* surfel_out;   // level << 27 | surfel; -1: none
};

// Sums of one block: information (21 upper, row by row), gradient, and scalars. J = (x cross n / lever, n).
struct PassSums {
  float a[21], g[6];
  float cost;        // sum of w r^2 / v
  float chi;         // sum of w r^2 / (v_live + height)
  float weight;      // sum of w
  float square;      // sum of w r^2
  float pairs;       // with w > 0
  float candidates;  // points whose surfel counts, however far
  float flipped;     // rejected because the normals point the other way
};

void pass_baseline(const Pass& pass, long begin, long end, PassSums* sums);
void pass_avx2(const Pass& pass, long begin, long end, PassSums* sums);

}  // namespace sgrt::kernels
