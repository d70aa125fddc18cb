"""The C++ standard headers for avr-gcc: what they say is what the real library says."""

import subprocess
from pathlib import Path

import pytest

from tests.slow import SLOW

ROOT = Path(__file__).resolve().parents[2]
AVR = ("-c", "-mmcu=atmega2560", "-std=gnu++11")
STRICT = ("-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Wdouble-promotion", "-Werror")
AVR_STD = ROOT / "firmware" / "avr_std"
HEADERS = sorted(path.name for path in AVR_STD.iterdir())
HOST_ONLY = {
    "auvest/board/file_store.hpp",  # there are no files
    "auvest/math/simd.hpp",  # they need xsimd
    "auvest/particles/simd_lanes.hpp",
}
PUBLIC = sorted(
    {
        path.relative_to(ROOT / "cpp" / "include").as_posix()
        for path in (ROOT / "cpp" / "include").rglob("*.hpp")
    }
    - HOST_ONLY
)
OUR_PATHS = (f"-I{AVR_STD}",)
AUVEST_PATHS = (f"-I{ROOT / 'cpp' / 'include'}", *OUR_PATHS, "-I/usr/include/eigen3")

# Prints what a standard library says and does. Compiled twice on the host: once with its own
# library, once with ours (-nostdinc++ hides the other).
SAYS = """
#include <stdio.h>
#include <string.h>
template <class T>
void print(const T& value) {  // its bytes
  const unsigned char* bytes = reinterpret_cast<const unsigned char*>(&value);
  const size_t size = sizeof(T) == sizeof(long double) ? 10 : sizeof(T);  // the rest is padding
  for (size_t i = 0; i < size; ++i) printf("%02x", bytes[i]);
  printf("\\n");
}

template <class T>
void print_limits(const char* name) {
  typedef std::numeric_limits<T> L;
  printf("%s: %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d %d\\n", name,
         L::is_specialized, L::is_signed, L::is_integer, L::is_exact, L::is_bounded, L::is_modulo,
         L::is_iec559, L::has_infinity, L::has_quiet_NaN, L::has_signaling_NaN, L::has_denorm_loss,
         L::has_denorm, L::round_style, L::tinyness_before, L::radix, L::digits, L::digits10,
         L::max_digits10, L::min_exponent, L::min_exponent10, L::max_exponent, L::max_exponent10,
         static_cast<int>(sizeof(L::max())));
  print((L::min)());
  print((L::max)());
  print(L::lowest());
  print(L::epsilon());
  print(L::round_error());
  print(L::infinity());
  print(L::denorm_min());
  print(L::quiet_NaN() != L::quiet_NaN());
}
#define LIMITS(T) print_limits<T>(#T)

template <class R, class T>
struct same { static const bool value = false; };
template <class T>
struct same<T, T> { static const bool value = true; };
#define IS(T, ...) \
  printf("%s is %s: %d\\n", #__VA_ARGS__, #T, same<decltype(__VA_ARGS__), T>::value)

struct Unknown {};

int main() {
  LIMITS(bool);
  LIMITS(char);
  LIMITS(signed char);
  LIMITS(unsigned char);
  LIMITS(short);
  LIMITS(unsigned short);
  LIMITS(int);
  LIMITS(unsigned int);
  LIMITS(long);
  LIMITS(unsigned long);
  LIMITS(long long);
  LIMITS(unsigned long long);
  LIMITS(float);
  LIMITS(double);
  LIMITS(long double);
  printf("%d\\n", std::numeric_limits<Unknown>::is_specialized);

  // The overload that a float takes returns a float.
#define ONE(f) IS(float, std::f(0.5f)); IS(double, std::f(0.5))
#define TWO(f) IS(float, std::f(0.5f, 0.5f)); IS(double, std::f(0.5, 0.5))
  ONE(acos); ONE(asin); ONE(atan); ONE(ceil); ONE(cos); ONE(cosh); ONE(exp); ONE(fabs);
  ONE(floor); ONE(log); ONE(log10); ONE(sin); ONE(sinh); ONE(sqrt); ONE(tan); ONE(tanh);
  ONE(abs); ONE(round); TWO(atan2); TWO(copysign); TWO(fmod); TWO(pow);
  IS(bool, std::isnan(0.5f)); IS(bool, std::isfinite(0.5)); IS(bool, std::isinf(0.5f));
  IS(int, std::abs(1)); IS(long, std::abs(1L));

  const float values[] = {0.0f, -0.0f, 0.5f, -1.5f, 2.5f, -2.5f, 1e-40f, 3.4e38f,
                          std::numeric_limits<float>::infinity(),
                          -std::numeric_limits<float>::infinity()};
  for (float x : values) {
    print(std::abs(x)); print(std::fabs(x)); print(std::abs(double(x))); print(std::round(x));
    print(std::floor(x)); print(std::ceil(x)); print(std::isfinite(x)); print(std::isinf(x));
    print(std::isnan(x)); print(std::signbit(x)); print(std::signbit(double(x)));
    print(std::isfinite(double(x))); print(std::isinf(double(x)));
    print(std::copysign(2.0f, x)); print(std::copysign(2.0, double(x)));
    print(std::copysign(x, -0.0f));
    if (x >= 0) print(std::sqrt(x));
    int e = 0, f = 0;
    if (std::isfinite(x)) {
      print(std::frexp(x, &e)); print(std::frexp(double(x), &f)); print(e); print(f);
      print(std::ldexp(x, -3)); print(std::fmod(x, 0.75f));
    }
  }
  const float nan = std::numeric_limits<float>::quiet_NaN();
  print(std::isnan(nan)); print(std::isnan(double(nan))); print(std::isfinite(nan));
  print(std::isinf(nan)); print(std::isnan(std::nan("")));
  print(std::abs(-7)); print(std::abs(-70000L)); print(std::labs(-70000L));

  int a[] = {5, 1, 4, 2, 3}, b[5] = {9, 9, 9, 9, 9};
  print(std::copy(a, a + 3, b) - b); print(b);
  print(a + 5 - std::copy_backward(a, a + 4, a + 5)); print(a);
  print(std::fill_n(b, 2, 7) - b); print(b);
  print(std::swap_ranges(a, a + 2, b + 3) - b); print(a); print(b);
  std::swap(a[0], b[0]); print(a); print(b);
  print((std::min)(2, 1)); print((std::max)(2, 1));
  print((std::min)(1, 2)); print((std::max)(1, 2));
  const int one = 1, same_one = 1;  // of equals, the first
  print(&(std::min)(one, same_one) == &one); print(&(std::max)(one, same_one) == &one);
  const std::pair<int, float> pair(3, 0.5f); print(pair.first); print(pair.second);

  print(std::plus<int>()(5, 3)); print(std::minus<int>()(5, 3));
  print(std::multiplies<int>()(5, 3)); print(std::divides<int>()(5, 3));
  print(std::negate<int>()(5)); print(std::logical_not<int>()(5));
  for (int x = 0; x < 3; ++x) {
    print(std::equal_to<int>()(x, 1)); print(std::not_equal_to<int>()(x, 1));
    print(std::less<int>()(x, 1)); print(std::less_equal<int>()(x, 1));
    print(std::greater<int>()(x, 1)); print(std::greater_equal<int>()(x, 1));
    print(std::logical_and<int>()(x, 1)); print(std::logical_or<int>()(x, 0));
  }
  const std::complex<float> z(3.0f, -4.0f);
  print(z.real()); print(std::real(z)); print(z.imag()); print(std::imag(z));
  print(std::conj(z).real()); print(std::conj(z).imag()); print(std::complex<float>(2.0f).imag());

  char text[8] = "abcdefg";
  std::memmove(text + 1, text, 4); print(text);
  std::memcpy(text, "xy", 2); print(text);
  std::memset(text, '-', 3); print(text);
  print(sizeof(std::int8_t)); print(sizeof(std::uint16_t)); print(sizeof(std::int32_t));
  print(sizeof(std::uint64_t)); print(sizeof(std::uintptr_t) == sizeof(void*));
  IS(std::size_t, sizeof(int)); IS(std::ptrdiff_t, text - text); IS(std::nullptr_t, nullptr);

  int place = 0;
  int* made = new (&place) int(42);
  print(place); print(made == &place);
}
"""


def include(*headers):
    return "".join(f"#include <{header}>\n" for header in headers)


@pytest.mark.parametrize("standard", ["gnu++11", "gnu++17"])
def test_they_say_what_the_real_library_says(compile_cpp, tmp_path, standard):
    def says(*options):
        options = (f"-std={standard}", "-O1", "-fno-exceptions", *options)
        compile_cpp("g++", include(*HEADERS) + SAYS, *options)
        done = subprocess.run([tmp_path / "object"], capture_output=True, text=True, check=True)
        return done.stdout.splitlines()

    theirs, ours = says(), says("-nostdinc++", *OUR_PATHS)
    assert len(theirs) > 400
    assert ours == theirs


@pytest.mark.parametrize("option", ["-Os", "-O2"])
@pytest.mark.parametrize("header", HEADERS)
def test_each_compiles_alone(compile_cpp, header, option):
    compile_cpp("avr-g++", include(header, header), *AVR, option, *STRICT, *OUR_PATHS)


@pytest.mark.parametrize("option", ["-Os", "-O2"])
@pytest.mark.parametrize("order", [1, -1])
def test_all_compile_together(compile_cpp, order, option):
    compile_cpp("avr-g++", include(*HEADERS[::order]), *AVR, option, *STRICT, *OUR_PATHS)


def test_no_header_is_superfluous(compile_cpp, tmp_path):
    """Each is included by something: auvest, Eigen or another of them."""
    compile_cpp("avr-g++", include(*PUBLIC), *AVR[1:], "-M", *AUVEST_PATHS)
    listed = (tmp_path / "object").read_text().replace("\\\n", " ").split()
    assert {name for name in HEADERS if str(AVR_STD / name) in listed} == set(HEADERS)


@pytest.mark.parametrize("compiler", ["g++", "clang++", "arm-none-eabi-g++"])
def test_they_give_way_to_a_real_library(compile_cpp, compiler):
    """Arduino shows them to the compilers of all boards."""
    uses = """
    #include <type_traits>
    static_assert(std::is_same<std::string::value_type, char>::value, "a real string");
    int size() { return static_cast<int>(std::string("abc").size()); }
    """
    for headers in (HEADERS, HEADERS[::-1]):
        source = include(*headers) + uses
        compile_cpp(compiler, source, "-c", "-std=gnu++11", *STRICT, *OUR_PATHS)


@pytest.mark.parametrize(
    "headers",
    # That each says what it needs is seen with the host's library, too (tests/cpp).
    [PUBLIC, PUBLIC[::-1], *(pytest.param([header, header], marks=SLOW) for header in PUBLIC)],
    ids=lambda headers: headers[0] if len(headers) == 2 else f"from {headers[0]}",
)
def test_the_public_headers_compile_with_them(compile_cpp, headers):
    options = (*AVR[1:], "-fsyntax-only", *STRICT, *AUVEST_PATHS)  # templates: no code is made
    compile_cpp("avr-g++", include(*headers), *options)


def test_what_is_not_there_does_not_link(compile_cpp):
    """What is only named, for Eigen, cannot be called by mistake and give something wrong."""
    for call in ('std::string("text")', "rintf(0.5f)", "std::arg(std::complex<float>(1.0f))"):
        source = include("cmath", "complex", "string") + f"int main() {{ {call}; }}"
        error = compile_cpp(
            "avr-g++", source, "-mmcu=atmega2560", "-std=gnu++11", *OUR_PATHS, fails=True
        )
        assert "undefined reference" in error
