// Sets of a leaf's voxels as words, and as bytes that loops over voxels take or give.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>

namespace vshi {

// One bit a voxel of a leaf: word x, bit y · 8 + z.
using Bits = std::array<uint64_t, 8>;

constexpr uint64_t ROW_ENDS = 0x0101010101010101u;

// Byte z is 1 where bit z is set.
inline uint64_t spread(uint64_t byte) {
    const uint64_t copies = byte * ROW_ENDS & 0x8040201008040201u;
    return ((copies + 0x7f7f7f7f7f7f7f7fu) | copies) >> 7 & ROW_ENDS;
}

// Bytes 0 and 1 of a plane's voxels, from its word and back.
inline void spread_plane(uint64_t word, uint8_t bytes[64]) {
    for (int y = 0; y < 8; ++y) {
        const uint64_t row = spread(word >> 8 * y & 0xff);
        std::memcpy(bytes + 8 * y, &row, sizeof row);
    }
}

inline uint64_t pack_plane(const uint8_t bytes[64]) {
    uint64_t word = 0;
    for (int y = 0; y < 8; ++y) {
        uint64_t row;
        std::memcpy(&row, bytes + 8 * y, sizeof row);
        word |= (row * 0x0102040810204080u >> 56) << 8 * y;
    }
    return word;
}

} // namespace vshi
