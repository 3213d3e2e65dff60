#include "problems/import/formats/cell.h"

#include <Eigen/Core>
#include <cmath>
#include <type_traits>

#include "problems/import/formats/bytes.h"

namespace trueline {
namespace {

template <class T>
Cell CellOf(const char* bytes) {
  const T value = LoadLittle<T>(bytes);
  if constexpr (std::is_same_v<T, std::uint64_t>) {
    if (value >> 63 != 0) return Cell(static_cast<double>(value));
  }
  if constexpr (std::is_integral_v<T>) {
    return Cell(static_cast<std::int64_t>(value));
  } else {
    return Cell(static_cast<double>(value));
  }
}

// IEEE 754 binary16.
Cell HalfCell(const char* bytes) {
  const auto half = Eigen::numext::bit_cast<Eigen::half>(LoadLittle<std::uint16_t>(bytes));
  return Cell(static_cast<double>(static_cast<float>(half)));
}

// In the order of Scalar.
struct ScalarType {
  std::size_t size;  // bytes
  Cell (*read)(const char* bytes);
};
constexpr ScalarType kScalars[] = {
    {1, CellOf<std::int8_t>},   {1, CellOf<std::uint8_t>},  {2, CellOf<std::int16_t>},
    {2, CellOf<std::uint16_t>}, {4, CellOf<std::int32_t>},  {4, CellOf<std::uint32_t>},
    {8, CellOf<std::int64_t>},  {8, CellOf<std::uint64_t>}, {2, HalfCell},
    {4, CellOf<float>},         {8, CellOf<double>},
};

}  // namespace

bool Cell::Time(int exponent, TimeNs* time) const {
  std::int64_t factor = 1;
  for (int i = 0; i < exponent; ++i) factor *= 10;
  if (whole_) {
    std::int64_t product = 0;  // what wraps must not reach callers
    if (__builtin_mul_overflow(Load<std::int64_t>(), factor, &product)) return false;
    *time = product;
    return true;
  }
  const double count = Load<double>() * static_cast<double>(factor);
  if (!(std::abs(count) < 9e18)) return false;
  *time = std::llround(count);
  return true;
}

std::size_t SizeOf(Scalar type) { return kScalars[static_cast<std::size_t>(type)].size; }

Cell ReadScalar(Scalar type, const char* bytes) {
  return kScalars[static_cast<std::size_t>(type)].read(bytes);
}

}  // namespace trueline
