// What the default milk is made of: Mie theory for its droplets of fat and its casein.

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include "sim/light/optics_params.h"

namespace turbidock::light {
namespace {

constexpr double kPi = std::numbers::pi;

// Scattering by a sphere: efficiency, and mean cosine.
struct Sphere {
  double efficiency = 0, asymmetry = 0;
};

// Bohren & Huffman 1983, eqs. 4.61, 4.62, 4.88 and section 4.8: `x` is the circumference in
// wavelengths, `m` the relative index, real.
Sphere Mie(double x, double m) {
  const int terms = static_cast<int>(x + 4 * std::cbrt(x) + 2);
  const int deep = std::max(terms, static_cast<int>(m * x)) + 16;
  // logarithmic derivatives, downwards
  std::vector<double> d(static_cast<size_t>(deep) + 1);
  for (int n = deep; n > 0; --n) {
    const double over = n / (m * x);
    d[static_cast<size_t>(n) - 1] = over - 1 / (d[static_cast<size_t>(n)] + over);
  }
  double psi_before = std::cos(x), psi = std::sin(x), chi_before = -std::sin(x), chi = std::cos(x);
  std::complex<double> a_before, b_before;
  double sum = 0, forwards = 0;
  for (int n = 1; n <= terms; ++n) {
    const double psi_n = (2 * n - 1) / x * psi - psi_before;
    const double chi_n = (2 * n - 1) / x * chi - chi_before;
    const std::complex<double> xi_n(psi_n, -chi_n), xi(psi, -chi);
    const double of_a = d[static_cast<size_t>(n)] / m + n / x;
    const double of_b = d[static_cast<size_t>(n)] * m + n / x;
    const std::complex<double> a = (of_a * psi_n - psi) / (of_a * xi_n - xi);
    const std::complex<double> b = (of_b * psi_n - psi) / (of_b * xi_n - xi);
    sum += (2 * n + 1) * (std::norm(a) + std::norm(b));
    forwards += (2 * n + 1.0) / (n * (n + 1.0)) * std::real(a * std::conj(b));
    if (n > 1)
      forwards +=
          (n - 1.0) * (n + 1.0) / n * std::real(a_before * std::conj(a) + b_before * std::conj(b));
    a_before = a, b_before = b;
    psi_before = psi, psi = psi_n, chi_before = chi, chi = chi_n;
  }
  return {2 / (x * x) * sum, 2 * forwards / sum};
}

// Bohren & Huffman, appendix A; Wiscombe 1979, table 1.
TEST(Mie, IsThatOfTheTables) {
  EXPECT_NEAR(Mie(5.21282, 1.55).efficiency, 3.10543, 1e-4);
  EXPECT_NEAR(Mie(10, 1.5).efficiency, 2.88200, 1e-4);
  EXPECT_NEAR(Mie(10, 1.5).asymmetry, 0.742913, 1e-5);
}

// Scattering by what is suspended, per metre of it undiluted.
struct Suspended {
  double scattering_per_m = 0, forwards_per_m = 0;  // the latter times the cosine
};

// A share of the volume in spheres: log-normal, with this volume-surface mean diameter and
// deviation of the logarithm.
Suspended Spheres(double share, double mean_um, double deviation, double index,
                  double wavelength_um) {
  constexpr double kWater = 1.344;  // whey
  Suspended sum;
  double volume_um3 = 0;
  for (double z = -3.5; z <= 3.5; z += 0.125) {
    const double d_um = mean_um * std::exp(deviation * z - 2.5 * deviation * deviation);
    const double many = std::exp(-0.5 * z * z);
    const Sphere sphere = Mie(kPi * d_um * kWater / wavelength_um, index / kWater);
    const double area_um2 = many * kPi / 4 * d_um * d_um * sphere.efficiency;
    sum.scattering_per_m += 1e6 * share * area_um2;
    sum.forwards_per_m += 1e6 * share * area_um2 * sphere.asymmetry;
    volume_um3 += many * kPi / 6 * d_um * d_um * d_um;
  }
  return {sum.scattering_per_m / volume_um3, sum.forwards_per_m / volume_um3};
}

// Homogenised milk: 4 % of its volume is fat (index 1.46) in droplets of 0.45 um, 11 % swollen
// casein micelles of 0.15 um (3.4 g of water a gram: index 1.384).
TEST(Milk, IsFatAndCasein) {
  const WaterParams water;
  const double wavelength_um[] = {0.625, 0.525, 0.465};
  for (int k = 0; k < 3; ++k) {
    const Suspended fat = Spheres(0.04, 0.45, 0.6, 1.46, wavelength_um[k]);
    const Suspended casein = Spheres(0.11, 0.15, 0, 1.384, wavelength_um[k]);
    const double per_m = fat.scattering_per_m + casein.scattering_per_m;
    // a millionth of it in the water, which is 1 ml/m^3
    EXPECT_NEAR(water.milk_scattering_m2_ml[k], 1e-6 * per_m, 1e-4) << k;
    EXPECT_NEAR(water.milk_asymmetry[k], (fat.forwards_per_m + casein.forwards_per_m) / per_m, 1e-3)
        << k;
  }
}

}  // namespace
}  // namespace turbidock::light
