// A small time-of-flight camera and its taps by eq. 1, written out from the contract and not with the library.
#pragma once

#include <cmath>
#include <functional>

#include "scenes.hpp"
#include "tof/tof.hpp"

namespace sgrt::test {

constexpr double kLight = 299792458e3;  // mm/s
inline const std::vector<double> kQuarters = {0, kPi / 2, kPi, 3 * kPi / 2};

inline Rig tof_rig(int width, int height, std::vector<double> hz = {20e6}, std::vector<double> phases = kQuarters) {
  Camera c;
  c.id = "c", c.width = width, c.height = height;
  c.fx = c.fy = 1.2 * width, c.cx = (width - 1) / 2.0, c.cy = (height - 1) / 2.0;
  c.distortion_count = 5, c.distortion = {-0.1, 0.05, 1e-3, -1e-3, 0};
  Vec6 twist;
  twist << 0.4, -1.9, 0.7, 120, -340, 2000;
  c.camera_from_room = se3_exp(twist);
  Rig rig;
  rig.id = "tof", rig.room = "room";
  rig.cameras.push_back(make_camera(c));
  TofUnit u;
  u.id = "tof0", u.modulation_hz = std::move(hz), u.tap_phase_rad = std::move(phases);
  rig.tofs.push_back(u);
  return rig;
}

struct Light {
  double range, offset = 20000, amplitude = 8000;  // mm, counts
};

// frames x frequencies x taps x height x width floats, and their view.
struct Frames {
  std::vector<float> taps;
  TapsView view;
};

inline Frames frames_of(const Rig& rig, int frames, const std::function<Light(int frame, int tap, int y, int x)>& light,
                        Draw* noise = nullptr) {
  const TofUnit& u = rig.tofs[0];
  const Camera& c = rig.cameras[0];
  Frames out;
  out.view.shape = {frames, static_cast<std::int64_t>(u.modulation_hz.size()),
                    static_cast<std::int64_t>(u.tap_phase_rad.size()), c.height, c.width};
  for (int j = 0; j < frames; ++j) {
    for (double f : u.modulation_hz) {
      for (std::size_t k = 0; k < u.tap_phase_rad.size(); ++k) {
        for (int i = 0; i < c.width * c.height; ++i) {
          const Light l = light(j, static_cast<int>(k), i / c.width, i % c.width);
          const double phi = 4 * kPi * f * u.refractive_index * l.range / kLight;
          double tap = l.offset + l.amplitude * std::cos(phi - u.tap_phase_rad[k]);
          if (noise) tap += std::sqrt(tap / u.electrons_per_count) * gauss(*noise);
          out.taps.push_back(static_cast<float>(tap));
        }
      }
    }
  }
  out.view.data = out.taps.data();
  out.view.type = TapsView::Type::kF32;
  std::int64_t stride = sizeof(float);
  for (int i = 4; i >= 0; --i) {
    out.view.strides[static_cast<std::size_t>(i)] = stride;
    stride *= out.view.shape[static_cast<std::size_t>(i)];
  }
  return out;
}

inline std::shared_ptr<TofResult> measured(const Rig& rig, const Frames& frames, const TofOptions& options = {},
                                           const Run& run = kSilent) {
  TofSensor sensor(run, rig, 0, options, {});
  return sensor.measure(run, frames.view);
}

}  // namespace sgrt::test
