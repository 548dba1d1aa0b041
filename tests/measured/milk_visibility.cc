// Milk in the published pool in other words: the first columns of
// assets/measured/milk_visibility.csv. A row for each amount given, in ml/m3: how far one could see
// (where green light has left 2 % of a contrast), and the attenuation of green light per metre.

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "experiments/trial/scenario.h"
#include "sim/light/scattering.h"

int main(int argc, char** argv) {
  using namespace turbidock;
  for (int i = 1; i < argc; ++i) {
    const std::string milk = argv[i];
    const trial::Scenario scenario =
        trial::LoadScenario("pool_active", {"water.milk_ml_m3=" + milk});
    const double green_per_m = light::MakeMedium(scenario.light.water).extinction_per_m()[1];
    fmt::print("{},{:.6f},{:.6f}\n", milk, std::log(50) / green_per_m, green_per_m);
  }
}
