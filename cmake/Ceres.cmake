# Ceres' headers: registration refines with ceres::TinySolver, which is a header. Nothing of libceres is linked, so the way
# it was built (Debian's: with SuiteSparse, parts of which are GPL) does not reach the library.
find_path(CERES_INCLUDE_DIR ceres/tiny_solver.h REQUIRED)
add_library(sgrt_ceres_headers INTERFACE)
target_include_directories(sgrt_ceres_headers SYSTEM INTERFACE ${CERES_INCLUDE_DIR})
