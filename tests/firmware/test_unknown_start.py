"""An unknown start on the simulated chip: the bits of the host, from the ring to one place."""

import subprocess

import numpy as np

import auvest

pytest_plugins = ["board_support"]

# Three stations, a craft at rest; then one station 900 m off, so that the filter recovers. Written:
# after every range x, the lower triangle of P, how many components and what they say.
PROGRAM = """
#include "auvest/filters/gaussian_sum.hpp"
#include "auvest/filters/robust_ekf.hpp"
#include "auvest/models/leader_range.hpp"
#include "auvest/models/speed_heading.hpp"
#include "auvest/robust/igg.hpp"
#include "auvest/robust/rejection_streak.hpp"
#include "output.hpp"

using Inside = auvest::RobustEkf<auvest::SpeedHeading<float>>;
using Filter = auvest::GaussianSum<Inside, 16>;

Filter filter{Inside(auvest::Ekf<auvest::SpeedHeading<float>>(auvest::SpeedHeading<float>()))};

int main() {
  Filter::State x;
  Filter::Covariance P;
  x(0) = 12.0f;
  x(1) = 9.0f;
  auvest::math::set_zero(P);
  P(0, 0) = P(1, 1) = 1e8f;
  filter.reset(x, P);
  const float place[3][2] = {{0.0f, 0.0f}, {120.0f, 0.0f}, {60.0f, 90.0f}};
  auvest::Vector<float, 3> input;
  input(0) = 0.1f;
  input(1) = 0.0f;
  input(2) = 0.7f;
  for (uint8_t k = 0; k < 40; ++k) {
    begin(2);
    filter.predict(5.0f, input);
    end(2);
    auvest::LeaderRange<float, 2> station;
    station.params.leader_x_m = place[k % 3][0] - (k < 16 ? 0.0f : 900.0f);
    station.params.leader_y_m = place[k % 3][1];
    const float dx = 46.0f + 0.38f * static_cast<float>(k) - place[k % 3][0];
    const float dy = 53.0f + 0.32f * static_cast<float>(k) - place[k % 3][1];
    auvest::Vector<float, 1> z;
    z(0) = auvest::math::sqrt(dx * dx + dy * dy);
    begin(1);
    filter.update(z, station);
    end(1);
    const auto& belief = filter.belief();
    write(belief.x(0));
    write(belief.x(1));
    write(belief.P(0, 0));
    write(belief.P(1, 0));
    write(belief.P(1, 1));
    write(static_cast<float>(filter.size()));
    write(static_cast<float>(static_cast<uint8_t>(filter.convergence())));
  }
  finish();
}
"""

CHIP = """
#include "board.hpp"
using board::begin;
using board::end;
using board::finish;
inline void write(float value) {
  union { float value; uint8_t bytes[4]; } word = {value};
  for (uint8_t i = 0; i < 4; ++i) board::write(word.bytes[i]);
}
"""

HOST = """
#include <stdint.h>
#include <stdio.h>
inline void begin(int) {}
inline void end(int) {}
inline void finish() {}
inline void write(float value) { fwrite(&value, sizeof value, 1, stdout); }
"""


def in_python():
    """The same numbers from Python."""
    f = auvest.RobustEkf(
        [12.0, 9.0],
        np.eye(2) * np.float32(1e8),
        process=auvest.SpeedHeading(),
        sensors=auvest.LeaderRange(),
        kernel="igg",
        components=16,
        dtype="float32",
    )
    k = np.arange(40)
    places = np.array([(0, 0), (120, 0), (60, 90)], "f4")[k % 3]
    row = k.astype("f4")
    at = np.column_stack([row * np.float32(0.38) + 46, row * np.float32(0.32) + 53])
    apart = at - places
    z = np.sqrt(apart[:, 0] * apart[:, 0] + apart[:, 1] * apart[:, 1])
    places[:, 0] -= np.where(k < 16, np.float32(0), np.float32(900))
    inputs = np.tile(np.array([0.1, 0.0, 0.7], "f4"), (40, 1))
    found = f.run(z, dt=5.0, input=inputs, place=places)
    belief = [found.x, found.P[:, 0, :1], found.P[:, 1, :2]]
    return np.column_stack([*belief, found.mixture_size, found.convergence]).astype("f4")


def test_the_chip_has_the_bits_of_the_host_and_of_python(compile_avr, run_board, root, tmp_path):
    headers = ["-ffp-contract=off", f"-I{root / 'cpp/include'}", "-isystem", "/usr/include/eigen3"]
    (tmp_path / "host").mkdir()
    (tmp_path / "host" / "output.hpp").write_text(HOST)
    (tmp_path / "host" / "main.cpp").write_text(PROGRAM)
    program = tmp_path / "host" / "program"
    main = tmp_path / "host" / "main.cpp"
    build = ["g++", "-std=c++11", "-O1", *headers, main, "-o", program]
    subprocess.run(build, check=True)
    wanted = np.frombuffer(subprocess.run([program], capture_output=True).stdout, "<f4")
    (tmp_path / "output.hpp").write_text(CHIP)
    library = root / "firmware/library/src"
    elf = compile_avr(
        PROGRAM,
        *("-Wno-unused-parameter", "-fno-exceptions", f"-I{root / 'firmware/avr_std'}"),
        *(f"-I{root / 'cpp/include'}", "-I/usr/include/eigen3", f"-I{tmp_path}"),
        library / "avr_float.S",
    )
    run = run_board(elf, "--limit", "100")
    assert run.code == 0, run.error
    found = np.frombuffer(run.output, "<f4")
    rows = wanted.reshape(40, 7)
    assert found.tobytes() == wanted.tobytes()
    assert in_python().tobytes() == wanted.tobytes()

    x, size, says = rows[:, :2], rows[:, 5], rows[:, 6]
    k = np.arange(40)[:, None]
    truth = np.array([46.0, 53.0]) + k * [0.38, 0.32] - np.where(k < 16, 0.0, [900.0, 0.0])
    error = np.linalg.norm(x - truth, axis=1)
    assert size[0] == 16
    assert (size[6:16] == 1).all()
    assert error[15] < 0.2
    assert says[15] == 3
    assert (size[16:30] > 8).any()  # a ring after the recovery
    assert error[-1] < 0.2
    assert says[-1] == 3
