// Files of writers that do not look whether their bytes arrived are read again.
#ifndef VSHI_OIIO_VERIFY_H
#define VSHI_OIIO_VERIFY_H

#include "image/oiio/oiio_formats.h"

#include "base/hash.h"

#include <OpenImageIO/imageio.h>

#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

namespace vshi {

template <typename Value> constexpr OIIO::TypeDesc::BASETYPE oiio_type() {
    if constexpr (std::is_same_v<Value, float>) {
        return OIIO::TypeDesc::FLOAT;
    } else {
        return sizeof(Value) == 1 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16;
    }
}

// The heif writer copies whole rows of libheif's, which are longer than ours: so many bytes at most.
constexpr size_t READ_BEYOND = 1024;

template <typename Value> std::vector<Value> make_rows(const vshi_planes &planes, int rows) {
    return std::vector<Value>(static_cast<size_t>(rows) * static_cast<size_t>(planes.width) *
                                  static_cast<size_t>(planes.count) +
                              READ_BEYOND);
}

// What was written, in a word: the same for the same rows, however many at a time.
class Sum {
  public:
    template <typename Value> void add(const Value *row, size_t values) {
        const auto *bytes = reinterpret_cast<const unsigned char *>(row);
        const size_t count = values * sizeof(Value);
        uint64_t word;
        size_t at = 0;
        for (; at + sizeof word <= count; at += sizeof word) {
            std::memcpy(&word, bytes + at, sizeof word);
            sum_ = vshi_mix(sum_ + word);
        }
        word = 0;
        std::memcpy(&word, bytes + at, count - at);
        sum_ = vshi_mix(sum_ + word);
    }
    bool operator==(const Sum &other) const { return sum_ == other.sum_; }

  private:
    uint64_t sum_ = 0x9e3779b97f4a7c15;
};

vsh_result fail_write(vsh_error *error, const char *path, const std::string &why);

// Why nothing more can be written to a file, or 0: asked of a file that is to be thrown away.
int disk_error(const char *temporary);

// Whether a file holds what was written, as far as its format keeps it. Value: float, uint8_t or uint16_t.
template <typename Value>
vsh_result verify(const char *temporary, const char *path, const vshi_format &format,
                  const vshi_planes &planes, const Sum &written, vsh_error *error);

} // namespace vshi

#endif
