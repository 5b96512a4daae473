// The decompositions that core/eigen_once.inl names.
#define SGRT_EIGEN_ONCE template
#include "core/eigen.hpp"
