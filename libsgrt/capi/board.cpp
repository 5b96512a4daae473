// The board: its points, and finding it.
#include "calibration/board.hpp"

#include <algorithm>
#include <cmath>

#include "capi/capi.hpp"

namespace sgrt {
namespace {

sgrt_board default_board() {
  sgrt_board b{};
  b.struct_size = sizeof b;
  b.kind = SGRT_BOARD_CHESSBOARD;
  return b;
}

Board from_c(const sgrt_board* given) {
  need(given, "board");
  const sgrt_board c = read_struct(given, default_board(), "board.struct_size");
  const Board board{static_cast<BoardKind>(c.kind), c.columns, c.rows, c.spacing_mm};
  check_board(board);
  return board;
}

}  // namespace
}  // namespace sgrt

using namespace sgrt;

sgrt_status sgrt_board_init(sgrt_board* board, size_t size) {
  return guard([&] { init_struct(board, size, default_board(), "board"); });
}

sgrt_status sgrt_board_points(const sgrt_board* board, const sgrt_mut_view* points) {
  return guard([&] {
    const Points p = board_points(from_c(board));
    check_output(points, "points", SGRT_F64, {p.rows(), 3});
    write_view(*points, p.data());
  });
}

sgrt_status sgrt_board_detect(sgrt_context* context, const sgrt_board* board, const sgrt_view* image,
                              const sgrt_mut_view* pixels, const sgrt_mut_view* sigma_px, sgrt_board_info* info) {
  return guard([&] {
    const Board b = from_c(board);
    const ImageView view = image_of(image, "image");
    const std::int64_t n = static_cast<std::int64_t>(b.columns) * b.rows;
    check_output(pixels, "pixels", SGRT_F64, {n, 2});
    check_apart(pixels, "pixels", image, "image");
    if (!absent(sigma_px)) {
      check_output(sigma_px, "sigma_px", SGRT_F64, {n});
      check_apart(sigma_px, "sigma_px", image, "image");
      check_apart(sigma_px, "sigma_px", pixels, "pixels");
    }
    check_result(info, "info.struct_size");
    const Detection d = detect_board(run_of(context), b, view);
    std::vector<double> at(2 * n, std::nan("")), sigma(n, std::nan(""));
    for (std::size_t i = 0; i < d.index.size() && d.found; ++i) {
      at[2 * d.index[i]] = d.pixel[i].x();
      at[2 * d.index[i] + 1] = d.pixel[i].y();
      sigma[d.index[i]] = d.sigma_px[i];
    }
    write_view(*pixels, at.data());
    if (!absent(sigma_px)) write_view(*sigma_px, sigma.data());
    sgrt_board_info out{};
    out.found_count = d.found ? static_cast<std::int32_t>(d.index.size()) : 0;
    out.seen_columns = d.seen_columns;
    out.seen_rows = d.seen_rows;
    out.half_turn_ambiguous = half_turn_ambiguous(b) ? 1 : 0;
    write_struct(info, out);
    return answer(d.found ? Status::kOk : Status::kNotFound, d.why.c_str());
  });
}
