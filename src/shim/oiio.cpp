// Every image format but OpenEXR. OpenImageIO chooses nothing here: the format comes from a table of what was
// found to keep data, integers are made by us, and no value is multiplied by alpha or sent through a transfer
// curve. Not written, in 2.4: iff (loses pixels), sgi (bytes that nobody set), fits, ico and rla (hide a full
// disk), heif (lossy).
#include "shim/oiio.h"

#include "base/file.h"
#include "shim/guard.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <climits>
#include <cstring>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <unistd.h>
#include <vector>

namespace {

constexpr int32_t BITS_8_16 = VSHI_BITS_8 | VSHI_BITS_16;
constexpr int32_t BITS_ALL = BITS_8_16 | VSHI_BITS_32;
constexpr int32_t ANY_SIZE = INT_MAX;

// Sizes are the formats' own limits; libjpeg ends the process over its own. webp and gif drop the colour of
// transparent pixels, so they count as having no alpha.
constexpr vshi_format writable[] = {
    {"png", BITS_8_16, true, 1000000},       {"tiff", BITS_ALL, true, ANY_SIZE},
    {"jpeg", VSHI_BITS_8, false, 65500},     {"targa", VSHI_BITS_8, true, 65535},
    {"bmp", VSHI_BITS_8, true, 1000000},     {"hdr", VSHI_BITS_32, false, ANY_SIZE},
    {"pnm", VSHI_BITS_8, false, ANY_SIZE},   {"webp", VSHI_BITS_8, false, 16383},
    {"jpeg2000", BITS_8_16, true, ANY_SIZE}, {"dpx", BITS_ALL, true, ANY_SIZE},
    {"gif", VSHI_BITS_8, false, 65535},
};

// Read, too. Others are no still images, or readers that are not for untrusted files.
const char *const readable_only[] = {"cineon", "dds", "fits", "heif", "ico",
                                     "iff",    "psd", "rla",  "sgi",  "softimage"};

constexpr int64_t BAND = int64_t(1) << 20; // values handed over at a time, but a row at least

std::string lower(const char *text) {
    std::string result = text;
    std::transform(result.begin(), result.end(), result.begin(),
                   [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c); });
    return result;
}

// OpenImageIO's name of the format with this ending, out of "tiff:tif,tiff,tx;jpeg:jpg,…"; "" for none.
std::string format_of_ending(const std::string &ending) {
    const std::string list = OIIO::get_string_attribute("extension_list");
    for (size_t at = 0; !ending.empty() && at < list.size();) {
        const size_t end = std::min(list.find(';', at), list.size());
        const size_t colon = list.find(':', at);
        if (colon < end) {
            const std::string endings = "," + list.substr(colon + 1, end - colon - 1) + ",";
            if (endings.find("," + ending + ",") != std::string::npos) {
                return list.substr(at, colon - at);
            }
        }
        at = end + 1;
    }
    return "";
}

// pfm is read but not written by the pnm format; OpenImageIO 2.4 says so only when it is too late.
bool is_writable_ending(const std::string &ending) {
    return ending != "pfm";
}

bool is_readable(const std::string &name) {
    const auto same = [&](const char *other) { return name == other; };
    return std::any_of(std::begin(writable), std::end(writable),
                       [&](const vshi_format &f) { return same(f.name); }) ||
           std::any_of(std::begin(readable_only), std::end(readable_only), same);
}

// OpenImageIO's own file writing does not look at the result of its last flush, and its jpeg writer ends the
// process when a write fails.
class CheckedFile final : public OIIO::Filesystem::IOProxy {
  public:
    explicit CheckedFile(const char *path) : IOProxy(path, Write), sink_(vshi_sink_open(path)) {}
    ~CheckedFile() override { finish(); }
    CheckedFile(const CheckedFile &) = delete;
    CheckedFile &operator=(const CheckedFile &) = delete;

    const char *proxytype() const override { return "checked"; } // "file" would promise a FILE *
    void close() override {}                                     // finish() does, when all is written
    size_t size() const override {
        const off_t end = sink_.file >= 0 ? ::lseek(sink_.file, 0, SEEK_END) : 0;
        return end > 0 ? static_cast<size_t>(end) : 0;
    }
    size_t read(void *data, size_t count) override {
        const size_t done = pread(data, count, m_pos);
        m_pos += static_cast<int64_t>(done);
        return done;
    }
    size_t pread(void *data, size_t count, int64_t offset) override {
        const ssize_t done = sink_.file >= 0 ? ::pread(sink_.file, data, count, offset) : 0;
        return done > 0 ? static_cast<size_t>(done) : 0;
    }
    size_t write(const void *data, size_t count) override {
        const size_t done = pwrite(data, count, m_pos);
        m_pos += static_cast<int64_t>(done);
        return done;
    }
    size_t pwrite(const void *data, size_t count, int64_t offset) override {
        // A failure is kept for finish() and not told: libpng would print it.
        vshi_sink_write(&sink_, data, count, static_cast<uint64_t>(offset));
        return count;
    }
    // Closes; the first error of all, or 0.
    int finish() { return vshi_sink_close(&sink_); }

  private:
    vshi_sink sink_;
};

// 0 … 1 to 0 … maximum, to nearest; NaN becomes 0 because no comparison with it holds.
template <typename Integer> Integer quantise(float value) {
    constexpr double maximum = std::numeric_limits<Integer>::max();
    if (!(value > 0.0f)) {
        return 0;
    }
    return value < 1.0f ? static_cast<Integer>(value * maximum + 0.5) : std::numeric_limits<Integer>::max();
}

template <typename Value> Value convert(float value) {
    if constexpr (std::is_same_v<Value, float>) {
        return value;
    } else {
        return quantise<Value>(value);
    }
}

// Rows [first, last), interleaved.
template <typename Value>
void interleave(const vshi_planes &planes, int first, int last, std::vector<Value> &rows) {
    const size_t width = static_cast<size_t>(planes.width);
    const size_t count = static_cast<size_t>(planes.count);
    const size_t begin = static_cast<size_t>(first) * width;
    const size_t texels = static_cast<size_t>(last - first) * width;
    for (size_t c = 0; c < count; ++c) {
        const vshi_plane &plane = planes.planes[c];
        for (size_t i = 0; i < texels; ++i) {
            rows[i * count + c] =
                convert<Value>(plane.values != nullptr ? plane.values[begin + i] : plane.constant);
        }
    }
}

template <typename Value> constexpr OIIO::TypeDesc::BASETYPE oiio_type() {
    if constexpr (std::is_same_v<Value, float>) {
        return OIIO::TypeDesc::FLOAT;
    } else {
        return sizeof(Value) == 1 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16;
    }
}

OIIO::ImageSpec make_spec(const vshi_planes &planes, const std::string &format, OIIO::TypeDesc type) {
    OIIO::ImageSpec spec(planes.width, planes.height, planes.count, type);
    spec.attribute("Software", std::string("vdbshade ") + vsh_version());
    spec.attribute("oiio:UnassociatedAlpha", 1); // else colours are divided by alpha
    if (format == "tiff" || format == "dpx") {
        spec.attribute("DateTime", "1970:01:01 00:00:00"); // else the hour: same input, same bytes
    }
    spec.attribute("oiio:BitsPerSample", static_cast<int>(type.size()) * 8);
    if (format == "jpeg") {
        // R, G and B are unrelated data here: halving the resolution of their differences would mix them
        spec.attribute("compression", "jpeg:95");
        spec.attribute("jpeg:subsampling", "4:4:4");
    } else if (format == "webp") {
        spec.attribute("compression", "webp:100");
    } else if (format == "tiff") {
        spec.attribute("compression", "zip");
        spec.attribute("tiff:write_exif", 0); // there is none, and libtiff 4.5 refuses the empty one
    }
    return spec;
}

int rows_of_band(int64_t width, int64_t height, int64_t count) {
    return static_cast<int>(std::clamp<int64_t>(BAND / (width * count), 1, height));
}

std::string reason(const std::string &text) {
    return text.empty() ? "the writer gave no reason" : text;
}

template <typename Value>
vsh_result write_rows(OIIO::ImageOutput &output, const char *path, const vshi_planes &planes,
                      vsh_error *error) {
    const int step = rows_of_band(planes.width, planes.height, planes.count);
    std::vector<Value> rows(static_cast<size_t>(step) * static_cast<size_t>(planes.width) *
                            static_cast<size_t>(planes.count));
    for (int64_t y = 0; y < planes.height; y += step) {
        const int first = static_cast<int>(y);
        const int last = static_cast<int>(std::min<int64_t>(y + step, planes.height));
        interleave(planes, first, last, rows);
        if (!output.write_scanlines(first, last, 0, oiio_type<Value>(), rows.data())) {
            return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", path,
                             reason(output.geterror()).c_str());
        }
    }
    return VSH_OK;
}

template <typename Value>
vsh_result write_as(const char *temporary, const char *path, const vshi_format &format,
                    const vshi_planes &planes, vsh_error *error) {
    std::unique_ptr<CheckedFile> file; // outlives the writer, which may still use it when it goes
    auto output = OIIO::ImageOutput::create(format.name);
    if (!output) {
        OIIO::geterror();
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO has no %s", path, format.name);
    }
    output->threads(1);
    const OIIO::TypeDesc type(oiio_type<Value>());
    file = std::make_unique<CheckedFile>(temporary);
    if (!output->set_ioproxy(file.get())) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO cannot write %s safely", path,
                         format.name);
    }
    if (!output->open(temporary, make_spec(planes, format.name, type))) {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", path,
                         reason(output->geterror()).c_str());
    }
    vsh_result result = VSH_OK;
    if (output->spec().format != type || output->spec().nchannels != planes.count) {
        result = vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO writes %s as %d × %s only",
                           path, format.name, output->spec().nchannels, output->spec().format.c_str());
    }
    if (result == VSH_OK) {
        result = write_rows<Value>(*output, path, planes, error);
    }
    const bool closed = output->close();
    const std::string text = output->geterror();
    output.reset();
    const int number = file->finish();
    if (number != 0) { // says more than the writer's own words
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", path, std::strerror(number));
    }
    if (result == VSH_OK && !closed) {
        result =
            vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", path, reason(text).c_str());
    }
    return result;
}

// Rows of the file, interleaved, into the planes of the image.
vsh_result read_rows(OIIO::ImageInput &input, const char *path, vsh_image_file &image, vsh_error *error) {
    const OIIO::ImageSpec &spec = input.spec();
    const bool tiled = spec.tile_width > 0;
    const int step = tiled ? spec.tile_height : rows_of_band(image.width, image.height, image.channel_count);
    const size_t width = static_cast<size_t>(image.width);
    const size_t count = static_cast<size_t>(image.channel_count);
    const size_t texels = width * static_cast<size_t>(image.height);
    // not zeroed: a short file that claims to be huge fails before it costs memory
    const std::unique_ptr<float[]> rows(
        new float[static_cast<size_t>(std::min<int>(step, image.height)) * width * count]);
    for (int64_t y = 0; y < image.height; y += step) {
        const int last = static_cast<int>(std::min<int64_t>(y + step, image.height));
        const int from = static_cast<int>(y) + spec.y;
        const bool done =
            tiled ? input.read_tiles(0, 0, spec.x, spec.x + spec.width, from, last + spec.y, spec.z,
                                     spec.z + 1, 0, image.channel_count, OIIO::TypeDesc::FLOAT, rows.get())
                  : input.read_scanlines(0, 0, from, last + spec.y, spec.z, 0, image.channel_count,
                                         OIIO::TypeDesc::FLOAT, rows.get());
        if (!done) {
            return vshi_fail(error, VSH_ERROR_INPUT, "%s: could not be read at row %d: %s", path,
                             static_cast<int>(y), input.geterror().c_str());
        }
        const size_t begin = static_cast<size_t>(y) * width;
        for (size_t c = 0; c < count; ++c) {
            float *plane = image.values + c * texels + begin;
            for (size_t i = 0; i < (static_cast<size_t>(last) * width - begin); ++i) {
                plane[i] = rows[i * count + c];
            }
        }
    }
    return VSH_OK;
}

vsh_result read_file(const char *path, vsh_image_file **file, vsh_error *error) {
    const std::string ending = lower(vshi_path_ending(path));
    const std::string name = format_of_ending(ending);
    if (!is_readable(name)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: ending '%s': no image format that is read", path,
                         ending.c_str());
    }
    auto input = OIIO::ImageInput::create(name);
    if (!input) {
        OIIO::geterror();
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO does not read %s", path,
                         name.c_str());
    }
    input->threads(1);
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1); // else colours are multiplied by alpha
    config.attribute("oiio:RawColor", 1);
    OIIO::ImageSpec spec;
    if (!input->open(path, spec, config)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: could not be read as %s: %s", path, name.c_str(),
                         input->geterror().c_str());
    }
    if (spec.deep || spec.depth > 1) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: deep and volume images are not read", path);
    }
    vsh_image_file *image = nullptr;
    vsh_result result = vshi_image_file_new(path, spec.width, spec.height, spec.nchannels, &image, error);
    if (result != VSH_OK) {
        return result;
    }
    std::unique_ptr<vsh_image_file, void (*)(vsh_image_file *)> owner(image, vsh_image_free);
    for (int32_t c = 0; c < image->channel_count; ++c) {
        vshi_image_file_name(image, c, std::string(spec.channel_name(c)).c_str());
    }
    result = read_rows(*input, path, *image, error);
    if (result == VSH_OK) {
        *file = owner.release();
    }
    return result;
}

} // namespace

bool vshi_oiio_format(const char *path, vshi_format *format) {
    bool found = false;
    vshi::guard(nullptr, VSH_ERROR_INTERNAL, path, [&]() -> vsh_result {
        const std::string ending = lower(vshi_path_ending(path));
        const std::string name = is_writable_ending(ending) ? format_of_ending(ending) : "";
        const auto *entry = std::find_if(std::begin(writable), std::end(writable),
                                         [&](const vshi_format &f) { return name == f.name; });
        if (entry != std::end(writable)) {
            *format = *entry;
            found = true;
        }
        return VSH_OK;
    });
    return found;
}

const char *vshi_oiio_endings(void) {
    return "png, tif, jpg, tga, bmp, hdr, ppm, webp, jp2, dpx, gif";
}

vsh_result vshi_oiio_write(const char *temporary, const char *path, const vshi_format *format,
                           const vshi_planes *planes, int32_t bits, vsh_error *error) {
    return vshi::guard(error, VSH_ERROR_WRITE, path, [&]() -> vsh_result {
        switch (bits) {
        case 8:
            return write_as<uint8_t>(temporary, path, *format, *planes, error);
        case 16:
            return write_as<uint16_t>(temporary, path, *format, *planes, error);
        default:
            return write_as<float>(temporary, path, *format, *planes, error);
        }
    });
}

vsh_result vshi_oiio_read(const char *path, vsh_image_file **file, vsh_error *error) {
    *file = nullptr;
    return vshi::guard(error, VSH_ERROR_INPUT, path, [&] { return read_file(path, file, error); });
}
