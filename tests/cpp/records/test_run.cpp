// The record loop: when what is done, with which share of a plan, and what is refused.
#include <doctest/doctest.h>

#include <limits>
#include <vector>

#include "auvest/math/random.hpp"
#include "auvest/models/piecewise_acceleration.hpp"
#include "auvest/models/slave_motion.hpp"
#include "auvest/records/run.hpp"
#include "auvest/slat/ekf_slat.hpp"

namespace {

using auvest::Status;
using auvest::math::Random;
using Row = auvest::SlatRow<double, 2, double>;
using Echo = auvest::TimedEcho<double, double>;
using Sonar = auvest::Sonar<double>;

/// Takes the place of a filter and keeps what it is told: predictions as (dt, change of master 0,
/// change of master 1), updates as (0, masters...).
struct Diary {
  std::vector<std::vector<double>> lines;
  Status answer = Status::kOk;

  Status predict(double dt, const auvest::Vector<double, 2>& u, Random&,
                 const auvest::Vector<double, 2>* changes) {
    CHECK(u(0) == 7.0);
    lines.push_back({dt});
    for (int n = 0; changes != nullptr && n < 2; ++n) lines.back().push_back(changes[n](1));
    return answer;
  }

  Status update(const auvest::Echo<double>* echoes, int count, const Sonar&, Random&) {
    lines.push_back({0.0});
    for (int s = 0; s < count; ++s) {
      lines.back().push_back(echoes[s].z(0));
      lines.back().push_back(echoes[s].master);
    }
    return answer;
  }
};

Echo echo(double time_s, double range, int master) {
  Echo heard;
  heard.time_s = time_s;
  heard.echo.z << range, 0.1;
  heard.echo.master = master;
  return heard;
}

Row row(const std::vector<Echo>& echoes, bool planned = false) {
  Row r;
  r.from_s = 10.0;
  r.to_s = 14.0;
  r.u << 7.0, 0.2;
  r.planned = planned;
  r.changes[0] << 0.0, 8.0;
  r.changes[1] << 0.0, -4.0;
  r.echoes = echoes.data();
  r.count = static_cast<int>(echoes.size());
  return r;
}

using Lines = std::vector<std::vector<double>>;

Status run(Diary& diary, const Row& r) {
  Random random(1);
  return auvest::run_row(diary, r, Sonar(), random);
}

TEST_CASE("A reading without echoes is one prediction, with the plan as it is") {
  Diary diary;
  CHECK(run(diary, row({})) == Status::kOk);
  CHECK(diary.lines == Lines{{4.0}});
  diary.lines.clear();
  CHECK(run(diary, row({}, true)) == Status::kOk);
  CHECK(diary.lines == Lines{{4.0, 8.0, -4.0}});
}

TEST_CASE("Echoes split a reading; each part has its share of the plan, each time is one update") {
  Diary diary;
  const std::vector<Echo> echoes{echo(10.0, 90, 1), echo(11.0, 91, 0), echo(11.0, 92, 1),
                                 echo(14.0, 93, -1)};
  CHECK(run(diary, row(echoes, true)) == Status::kOk);
  CHECK(diary.lines == Lines{{0.0, 90.0, 1.0},
                             {1.0, 2.0, -1.0},
                             {0.0, 91.0, 0.0, 92.0, 1.0},
                             {3.0, 6.0, -3.0},
                             {0.0, 93.0, -1.0}});
}

TEST_CASE("A row of no length takes its echoes and predicts nothing") {
  Diary diary;
  const std::vector<Echo> echoes{echo(10.0, 90, 0)};
  Row r = row(echoes);
  r.to_s = r.from_s;
  CHECK(run(diary, r) == Status::kOk);
  CHECK(diary.lines == Lines{{0.0, 90.0, 0.0}});
}

TEST_CASE("What cannot be is refused at its place") {
  const std::vector<Echo> three{echo(12.0, 1, 0), echo(12.0, 2, 1), echo(12.0, 3, -1)};
  const std::vector<Echo> behind{echo(14.5, 1, 0)};
  const std::vector<Echo> nowhen{echo(std::numeric_limits<double>::quiet_NaN(), 1, 0)};
  for (const std::vector<Echo>& echoes : {three, behind, nowhen}) {
    Diary diary;
    CHECK(run(diary, row(echoes)) == Status::kBadParameter);
    for (const auto& line : diary.lines) CHECK(line.size() == 1);  // no update
  }
  // Backwards: the prediction is refused by the filter.
  const std::vector<Echo> before{echo(9.0, 1, 0)};
  const std::vector<Echo> shuffled{echo(12.0, 1, 0), echo(11.0, 1, 0)};
  for (const std::vector<Echo>& echoes : {before, shuffled}) {
    Random random(1);
    auvest::EkfSlat<auvest::CompassMotion<double>, auvest::PiecewiseAcceleration<double>, 2> filter{
        auvest::CompassMotion<double>(), auvest::PiecewiseAcceleration<double>()};
    auvest::Belief<double, 2> start;
    start.x.setZero();
    start.P.setIdentity();
    auvest::Belief<double, 6> master;
    master.x.setConstant(50.0);
    master.P.setIdentity();
    REQUIRE(filter.reset(start, random) == Status::kOk);
    REQUIRE(filter.add_master(master) == Status::kOk);
    CHECK(auvest::run_row(filter, row(echoes), Sonar(), random) == Status::kTimeBackwards);
  }
}

TEST_CASE("A filter that refuses ends the row and the record; the sink sees it") {
  const std::vector<Echo> echoes{echo(12.0, 1, 0)};
  for (const Status answer : {Status::kOk, Status::kOverflow}) {
    int left = 2;
    const auto next = [&](Row& r) {
      r = row(echoes);
      return left-- > 0;
    };
    Diary diary;
    diary.answer = answer;
    Random random(1);
    std::vector<Status> seen;
    const Status status =
        auvest::run_record<Row>(diary, next, Sonar(), random, [&](const Row& r, Status s) {
          CHECK(r.count == 1);
          seen.push_back(s);
        });
    CHECK(status == answer);
    if (answer == Status::kOk) {
      CHECK(seen == std::vector<Status>{Status::kOk, Status::kOk});
      CHECK(diary.lines.size() == 6);
    } else {
      CHECK(seen == std::vector<Status>{Status::kOverflow});
      CHECK(diary.lines.size() == 1);
    }
  }
}

}  // namespace
