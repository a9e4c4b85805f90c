#include "levelset/grid_reader.h"

#include <cstring>
#include <zlib.h>

namespace vshi {

namespace {

// RFC 1950: deflate, and a multiple of 31. Without it zlib refuses the data, which OpenVDB notices.
bool is_zip(const unsigned char *bytes, size_t size) {
    return size > 2 && (bytes[0] & 15) == 8 && (bytes[0] * 256 + bytes[1]) % 31 == 0;
}

bool fits(unsigned char *bytes, size_t size) {
    unsigned char unpacked[1 << 14];
    z_stream stream{};
    stream.next_in = bytes;
    stream.avail_in = uInt(size);
    if (inflateInit(&stream) != Z_OK) {
        return false;
    }
    int result = Z_OK;
    while (result == Z_OK) {
        stream.next_out = unpacked;
        stream.avail_out = sizeof unpacked;
        result = inflate(&stream, Z_NO_FLUSH);
    }
    inflateEnd(&stream);
    return result == Z_STREAM_END;
}

} // namespace

std::streamsize CheckedFile::xsgetn(char *bytes, std::streamsize size) {
    const std::streamsize read = std::filebuf::xsgetn(bytes, size);
    auto *data = reinterpret_cast<unsigned char *>(bytes);
    if (read == size && size == announced && size < (std::streamsize(1) << 31) &&
        is_zip(data, size_t(size))) {
        damaged = damaged || !fits(data, size_t(size));
    }
    announced = 0;
    if (read == size && size == std::streamsize(sizeof announced)) {
        std::memcpy(&announced, bytes, sizeof announced);
    }
    return read;
}

} // namespace vshi
