// Decoders of compressed files, and of compressed blocks in logs.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace trueline {

// What a decoder has read and written of its buffers; whether the content has ended.
struct DecodeStep {
  std::size_t read = 0, wrote = 0;
  bool ended = false, good = true;
};
using Decoder = std::function<DecodeStep(const char* in, std::size_t have, char* out,
                                         std::size_t room, bool is_last)>;

// zlib's streams: `bits` 31 for gzip, -15 for the bare content of a zip.
Decoder Inflater(int bits);
Decoder Bunzipper();
Decoder Unxzipper();
Decoder Unzstder();
Decoder Unlz4er();  // of a frame
Decoder Copier();

inline constexpr std::string_view kZstdMagic("\x28\xB5\x2F\xFD", 4);

// `compression`: "none" or "", "bz2", "lz4" (a frame), "zstd". `out` grows with what is
// decompressed and never beyond `limit` bytes. False if the compression is not known, the bytes are
// damaged, or the limit is passed.
bool Decompress(std::string_view compression, std::string_view bytes, std::uint64_t limit,
                std::string* out);

}  // namespace trueline
