// SPDX-License-Identifier: Apache-2.0
#include "core/statistics/distributions.hpp"

#include <boost/math/distributions/binomial.hpp>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <boost/math/distributions/normal.hpp>
#include <boost/math/distributions/students_t.hpp>

namespace drape {

namespace bm = boost::math;

double normal_quantile(double p) {
  return bm::quantile(bm::normal(), p);
}

double student_cdf(double t, double dof) {
  return bm::cdf(bm::students_t(dof), t);
}

double student_quantile(double p, double dof) {
  return bm::quantile(bm::students_t(dof), p);
}

double chi_square_tail(double chi2, double dof) {
  return chi2 > 0 ? bm::cdf(bm::complement(bm::chi_squared(dof), chi2)) : 1;
}

double chi_square_beyond(double p, double dof) {
  return bm::quantile(bm::complement(bm::chi_squared(dof), p));
}

double f_tail(double f, double numerator_dof, double denominator_dof) {
  if (!(f > 0)) return 1;
  return bm::cdf(bm::complement(bm::fisher_f(numerator_dof, denominator_dof), f));
}

double probability_bound(int seen, int trials, double confidence) {
  if (seen >= trials) return 1;
  return bm::binomial::find_upper_bound_on_p(trials, seen, 1 - confidence);
}

}  // namespace drape
