// Decompression of blocks in logs.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace trueline {

inline constexpr std::string_view kZstdMagic("\x28\xB5\x2F\xFD", 4);

// `compression`: "none" or "", "bz2", "lz4" (a frame), "zstd". `out` grows with what is
// decompressed and never beyond `limit` bytes. False if the compression is not known, the bytes are
// damaged, or the limit is passed.
bool Decompress(std::string_view compression, std::string_view bytes, std::uint64_t limit,
                std::string* out);

}  // namespace trueline
