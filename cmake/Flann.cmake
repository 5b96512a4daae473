# FLANN's headers, and lz4, which they call. core/nearest.cpp instantiates flann::KDTreeSingleIndex from them, so neither
# libflann nor its HDF5 is linked.
find_path(FLANN_INCLUDE_DIR flann/flann.hpp REQUIRED)
find_library(LZ4_LIBRARY lz4 REQUIRED)
add_library(sgrt_flann INTERFACE)
target_include_directories(sgrt_flann SYSTEM INTERFACE ${FLANN_INCLUDE_DIR})
target_link_libraries(sgrt_flann INTERFACE ${LZ4_LIBRARY})
