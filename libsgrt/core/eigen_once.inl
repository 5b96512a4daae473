// The decompositions that a build would take longest for, were they compiled in each file that uses them: they are in
// core/eigen.cpp only. A decomposition of an expression is another one: give it a matrix, Mat6(a * b).
#ifndef SGRT_EIGEN_ONCE
#define SGRT_EIGEN_ONCE extern template
#endif  // NOLINTBEGIN(bugprone-macro-parentheses): types

#define SGRT_EIGENSOLVER(M)                                                                    \
  SGRT_EIGEN_ONCE Eigen::SelfAdjointEigenSolver<M>& Eigen::SelfAdjointEigenSolver<M>::compute( \
      const Eigen::EigenBase<M>&, int);
SGRT_EIGENSOLVER(sgrt::Mat3)
SGRT_EIGENSOLVER(sgrt::Mat6)
SGRT_EIGENSOLVER(Eigen::MatrixXd)
#undef SGRT_EIGENSOLVER
SGRT_EIGEN_ONCE Eigen::SelfAdjointEigenSolver<sgrt::Mat3>& Eigen::SelfAdjointEigenSolver<sgrt::Mat3>::computeDirect(
    const sgrt::Mat3&, int);

#define SGRT_LDLT(M, V)                                                                  \
  SGRT_EIGEN_ONCE Eigen::LDLT<M>& Eigen::LDLT<M>::compute(const Eigen::EigenBase<M>&);   \
  SGRT_EIGEN_ONCE void Eigen::LDLT<M>::_solve_impl_transposed<true>(const V&, V&) const; \
  SGRT_EIGEN_ONCE void Eigen::LDLT<M>::_solve_impl_transposed<true>(const M::IdentityReturnType&, M&) const;
SGRT_LDLT(sgrt::Mat3, sgrt::Vec3)
SGRT_LDLT(sgrt::Mat6, sgrt::Vec6)
SGRT_LDLT(Eigen::MatrixXd, Eigen::VectorXd)
#undef SGRT_LDLT
SGRT_EIGEN_ONCE void Eigen::LDLT<Eigen::MatrixXd>::_solve_impl_transposed<true>(const Eigen::MatrixXd&,
                                                                                Eigen::MatrixXd&) const;

SGRT_EIGEN_ONCE Eigen::LLT<sgrt::Mat6>& Eigen::LLT<sgrt::Mat6>::compute(const Eigen::EigenBase<sgrt::Mat6>&);
SGRT_EIGEN_ONCE Eigen::LLT<Eigen::MatrixXd>& Eigen::LLT<Eigen::MatrixXd>::compute(
    const Eigen::EigenBase<Eigen::MatrixXd>&);
SGRT_EIGEN_ONCE Eigen::JacobiSVD<sgrt::Mat3>& Eigen::JacobiSVD<sgrt::Mat3>::compute(const sgrt::Mat3&, unsigned);
SGRT_EIGEN_ONCE Eigen::JacobiSVD<Eigen::MatrixXd>& Eigen::JacobiSVD<Eigen::MatrixXd>::compute(const Eigen::MatrixXd&,
                                                                                              unsigned);
SGRT_EIGEN_ONCE void Eigen::PartialPivLU<Eigen::MatrixXd>::compute();
// Of products of large matrices.
SGRT_EIGEN_ONCE struct Eigen::internal::gebp_kernel<
    double, double, Eigen::Index, Eigen::internal::blas_data_mapper<double, Eigen::Index, 0, 0, 1>,
    Eigen::internal::gebp_traits<double, double>::mr, Eigen::internal::gebp_traits<double, double>::nr, false, false>;
#undef SGRT_EIGEN_ONCE  // NOLINTEND(bugprone-macro-parentheses)
