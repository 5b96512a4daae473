// The patient's skin from a planning CT (the chapter: "another option is to obtain the reference image from the
// planning CT image"), with its expected error. docs/theory/volume.md.
#pragma once

#include <limits>
#include <vector>

#include "core/run.hpp"
#include "core/surface.hpp"
#include "volume/voxels.hpp"

namespace sgrt {

// Why a vertex is not skin that was measured.
enum SkinFlag : std::uint8_t {
  kSkinCut = 1,      // the body goes on beyond the volume or the scanner's field of view
  kSkinContact = 2,  // couch or another object touches the skin here
  kSkinClosed = 4,   // an airway or cavity was closed here
  kSkinNoEdge = 8,   // no clear edge between air and tissue
};

struct SkinOptions {
  double threshold =
      std::numeric_limits<double>::quiet_NaN();  // HU; NaN: half-way from air to the tissue at each place
  double body_threshold = -480;                  // HU, what finds the body
  double closing = 4;                            // mm
  Vec3 down = Vec3::Zero();                      // towards the couch, frame of the volume; zero: no couch is searched
  double smoothing =
      std::numeric_limits<double>::quiet_NaN();  // mm, radius; 0: none, NaN: 2.5 or twice the coarsest spacing
  double padding = std::numeric_limits<double>::quiet_NaN();  // value of voxels that were not scanned; NaN: below -1100
};

// A closed body.
struct Skin {
  Surface mesh;                     // points, normals, faces, sigma
  std::vector<std::uint8_t> flags;  // SkinFlag, a vertex
  Eigen::VectorXd bias;             // mm, expected distance of the vertex outside (+) the true skin
  double volume = 0;                // mm3, of the closed mesh
  bool couch_found = false;
  double contrast = 0;  // median of tissue minus air, HU; NaN for contours
};

Skin skin_of_volume(const Run& run, const Voxels& voxels, const SkinOptions& options);

struct SkinFigures {
  double bias, sigma;  // mm: mean bias and median sigma of the vertices without a flag
};
SkinFigures figures_of(const Skin& skin);

// The part of the mesh whose vertices have none of these flags, without vertices that no face uses.
Surface part_without(const Skin& skin, std::uint8_t flags);

// Of a closed mesh, by the divergence theorem.
double volume_of(const Points& points, const Faces& faces);

}  // namespace sgrt
