// What an independent prototype in double precision gave for the cases of unknown_start.hpp, with
// its own random numbers: shares in percent after 10, 30 and 100 ranges.
#pragma once

#include "simulation/unknown_start.hpp"

namespace auvest {

struct StartCase {
  const char* name;
  int leaders;
  bool spread;

  void place(StartScenario& scenario) const {
    scenario.leaders = leaders;
    scenario.spread = spread;
  }
};

/// Of 500 runs from a sigma of 1e4 m.
struct StartFigures {
  StartCase which;
  double clean[2][3];  ///< right, K = 16 and 32
  double late[2][3];   ///< the same where every tenth range is late
};

const int kStartFigureRuns = 500;
const StartFigures kStartFigures[] = {
    {{"1", 1, true}, {{1, 63, 96}, {1, 70, 98}}, {{1, 60, 95}, {1, 66, 97}}},
    {{"2 good", 2, true}, {{96, 100, 99}, {98, 100, 99}}, {{81, 98, 100}, {83, 98, 100}}},
    {{"2 bad", 2, false}, {{61, 94, 99}, {73, 96, 99}}, {{55, 94, 99}, {63, 94, 99}}},
    {{"3 good", 3, true}, {{100, 100, 100}, {100, 100, 100}}, {{88, 100, 100}, {87, 99, 100}}},
    {{"3 bad", 3, false}, {{77, 99, 100}, {89, 99, 100}}, {{64, 98, 100}, {76, 98, 100}}},
    {{"4 good", 4, true}, {{100, 100, 99}, {100, 100, 99}}, {{83, 99, 100}, {82, 100, 100}}},
    {{"4 bad", 4, false}, {{82, 99, 100}, {92, 99, 100}}, {{72, 98, 100}, {78, 99, 100}}},
};

/// The share of runs that are wrong and settled, after 30 and after 100 ranges, at most.
inline double start_wrong_bound(int components) { return components < 32 ? 0.01 : 0.005; }

/// Of 300 runs with the truth drawn from the prior and every tenth range late, K = 16: in the order
/// of kStartPriorCases.
struct StartPriorFigures {
  double sigma_m;
  double right[4][3];
};

const int kStartPriorRuns = 300;
const StartCase kStartPriorCases[4] = {
    {"1", 1, true}, {"2 bad", 2, false}, {"3 good", 3, true}, {"3 bad", 3, false}};
const StartPriorFigures kStartPriorFigures[] = {
    {1, {{99, 99, 100}, {100, 99, 100}, {100, 100, 100}, {99, 100, 100}}},
    {10, {{45, 83, 98}, {77, 97, 100}, {88, 99, 100}, {87, 99, 100}}},
    {100, {{1, 67, 97}, {58, 95, 99}, {90, 99, 100}, {70, 97, 100}}},
    {300, {{1, 62, 96}, {54, 91, 99}, {87, 100, 100}, {66, 97, 99}}},
    {1e3, {{1, 60, 97}, {53, 92, 100}, {89, 99, 100}, {66, 96, 100}}},
    {1e5, {{1, 61, 96}, {55, 93, 99}, {88, 99, 100}, {65, 96, 100}}},
    {1e6, {{1, 61, 96}, {55, 93, 99}, {88, 99, 100}, {65, 96, 100}}},  // as 1e5
};

/// How soon 200 runs with a prior of 1 m were back, K = 16, every tenth range late; cases as above.
struct StartReturnFigures {
  const char* name;
  double displaced_m;
  std::uint32_t bad_step;
  int median[4], most[4];
  double never[4];  ///< %
};

const int kStartReturnRuns = 200;
const StartReturnFigures kStartReturnFigures[] = {
    {"200 m off", 200, 0, {35, 17, 12, 14}, {84, 40, 15, 26}, {6.5, 0.5, 0, 0}},
    {"1000 m off", 1000, 0, {33, 17, 12, 14}, {86, 35, 16, 25}, {8, 1, 0, 0.5}},
    {"a wrong time stamp", 0, 40, {35, 18, 13, 15}, {83, 32, 19, 26}, {6.5, 0, 0, 0.5}},
};

}  // namespace auvest
