#include "image/oiio/oiio_verify.h"

#include <algorithm>
#include <cerrno>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace vshi {

namespace {

// Bytes of a whole file, or -1 where that is not known beforehand.
int64_t whole_size(const std::string &format, const vshi_planes &planes, int64_t value_size) {
    const int64_t width = planes.width, height = planes.height, count = planes.count;
    if (format == "sgi") {
        return 512 + width * height * count * value_size;
    }
    if (format == "ico") { // headers, pixels, and a mask of bits in rows of whole words
        return 62 + height * (width * 4 + (width + 31) / 32 * 4);
    }
    if (format == "rla") { // header, offset of each row, and a size before each channel's values
        return 740 + height * (4 + count * (2 + width * value_size));
    }
    return -1;
}

template <typename Value>
bool reads_back(OIIO::ImageInput &input, const vshi_format &format, const vshi_planes &planes,
                const Sum &written) {
    const int step = rows_of_band(planes.width, planes.height, planes.count);
    const size_t values = static_cast<size_t>(planes.width) * static_cast<size_t>(planes.count);
    std::vector<Value> found = make_rows<Value>(planes, step);
    Sum sum;
    for (int64_t y = 0; y < planes.height; y += step) {
        const int first = static_cast<int>(y);
        const int last = static_cast<int>(std::min<int64_t>(y + step, planes.height));
        if (!input.read_scanlines(0, 0, first, last, 0, 0, planes.count, oiio_type<Value>(), found.data())) {
            return false;
        }
        for (int row = first; row < last; ++row) {
            sum.add(found.data() + static_cast<size_t>(row - first) * values, values);
        }
    }
    return format.lossy || sum == written;
}

} // namespace

vsh_result fail_write(vsh_error *error, const char *path, const std::string &why) {
    return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", path, why.c_str());
}

int disk_error(const char *temporary) {
    const char more[4096] = {0};
    const int file = ::open(temporary, O_WRONLY | O_APPEND | O_CLOEXEC);
    const ssize_t written = file >= 0 ? ::write(file, more, sizeof more) : -1;
    const int number = written < 0 ? errno : written < ssize_t(sizeof more) ? ENOSPC : 0;
    if (file >= 0) {
        ::close(file);
    }
    return number;
}

template <typename Value>
vsh_result verify(const char *temporary, const char *path, const vshi_format &format,
                  const vshi_planes &planes, const Sum &written, vsh_error *error) {
    const int64_t size = whole_size(format.name, planes, sizeof(Value));
    struct stat status;
    bool whole = ::stat(temporary, &status) == 0 && (size < 0 || status.st_size == size);
    if (whole) {
        const auto input = OIIO::ImageInput::create(format.name);
        OIIO::ImageSpec config, spec;
        config.attribute("oiio:UnassociatedAlpha", 1);
        config.attribute("oiio:RawColor", 1);
        whole = input != nullptr && input->open(temporary, spec, config) && spec.width == planes.width &&
                spec.height == planes.height && spec.nchannels == planes.count &&
                reads_back<Value>(*input, format, planes, written);
        OIIO::geterror();
    }
    if (whole) {
        return VSH_OK;
    }
    const int number = disk_error(temporary);
    return fail_write(error, path, number != 0 ? std::strerror(number) : "it is not read back as written");
}

template vsh_result verify<float>(const char *, const char *, const vshi_format &, const vshi_planes &,
                                  const Sum &, vsh_error *);
template vsh_result verify<uint8_t>(const char *, const char *, const vshi_format &, const vshi_planes &,
                                    const Sum &, vsh_error *);
template vsh_result verify<uint16_t>(const char *, const char *, const vshi_format &, const vshi_planes &,
                                     const Sum &, vsh_error *);

} // namespace vshi
