#include "problems/import/formats/cell.h"

#include <Eigen/Core>
#include <cmath>

#include "problems/import/formats/bytes.h"
#include "problems/log/csv_text.h"

namespace trueline {
namespace {

// IEEE 754 binary16.
double HalfToDouble(std::uint16_t half) {
  return static_cast<double>(static_cast<float>(Eigen::numext::bit_cast<Eigen::half>(half)));
}

template <class T>
Cell WholeCell(const char* bytes) {
  return Cell(static_cast<std::int64_t>(LoadLittle<T>(bytes)));
}

Cell UnsignedCell(std::uint64_t value) {
  return value >> 63 != 0 ? Cell(static_cast<double>(value))
                          : Cell(static_cast<std::int64_t>(value));
}

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

std::size_t SizeOf(Scalar type) {
  switch (type) {
    case Scalar::kI8:
    case Scalar::kU8:
      return 1;
    case Scalar::kI16:
    case Scalar::kU16:
    case Scalar::kF16:
      return 2;
    case Scalar::kI32:
    case Scalar::kU32:
    case Scalar::kF32:
      return 4;
    default:
      return 8;
  }
}

Cell ReadScalar(Scalar type, const char* bytes) {
  switch (type) {
    case Scalar::kI8:
      return WholeCell<std::int8_t>(bytes);
    case Scalar::kU8:
      return WholeCell<std::uint8_t>(bytes);
    case Scalar::kI16:
      return WholeCell<std::int16_t>(bytes);
    case Scalar::kU16:
      return WholeCell<std::uint16_t>(bytes);
    case Scalar::kI32:
      return WholeCell<std::int32_t>(bytes);
    case Scalar::kU32:
      return WholeCell<std::uint32_t>(bytes);
    case Scalar::kI64:
      return WholeCell<std::int64_t>(bytes);
    case Scalar::kU64:
      return UnsignedCell(LoadLittle<std::uint64_t>(bytes));
    case Scalar::kF16:
      return Cell(HalfToDouble(LoadLittle<std::uint16_t>(bytes)));
    case Scalar::kF32:
      return Cell(static_cast<double>(LoadLittle<float>(bytes)));
    case Scalar::kF64:
      return Cell(LoadLittle<double>(bytes));
  }
  return Cell();
}

void ParseCells(const std::vector<std::string_view>& texts, std::size_t first,
                std::vector<Cell>* cells) {
  for (std::size_t i = first; i < texts.size(); ++i) {
    double value = 0.0;
    if (ParseNumber(texts[i], &value)) (*cells)[i] = Cell(value);
  }
}

}  // namespace trueline
