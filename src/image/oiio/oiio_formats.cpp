// Which formats are written and read. OpenImageIO chooses nothing here: the table is of what was found to
// keep data, with OpenImageIO 2.4. docs/formats.md shows it to users.
#include "image/oiio/oiio_formats.h"

#include "base/file.h"
#include "extern/guard.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <climits>

namespace vshi {

namespace {

constexpr int32_t BITS_8_16 = VSHI_BITS_8 | VSHI_BITS_16;
constexpr int32_t BITS_ALL = BITS_8_16 | VSHI_BITS_32;
constexpr int32_t ANY_SIZE = INT_MAX;

// Sizes are the formats' own limits, but for: libjpeg ends the process over its own; the reader of heif goes
// to 32768; rows of floats in rla are counted with 16 bits; ico needs PNG for 256, whose size its writer
// leaves out. webp and gif drop the colour of transparent pixels, so they count as having no alpha; iff
// without alpha loses pixels, and ico is read with alpha only. iff mixes up the bytes of 16-bit alpha, and
// rla the last pixel of a row of integers. What is held until the end was measured as peak memory of 4096²
// (2048² for heif) pixels that came eight rows at a time.
constexpr vshi_format writable[] = {
    // name, bits, alpha, size, lossy, grey, held
    {"tiff", BITS_ALL, VSHI_ALPHA_KEPT, ANY_SIZE, false, false, 0.0},
    {"jpeg", VSHI_BITS_8, VSHI_ALPHA_NONE, 65500, true, false, 0.3},
    {"targa", VSHI_BITS_8, VSHI_ALPHA_KEPT, 65535, false, false, 0.0},
    {"bmp", VSHI_BITS_8, VSHI_ALPHA_KEPT, 1000000, false, false, 0.0},
    {"hdr", VSHI_BITS_32, VSHI_ALPHA_NONE, ANY_SIZE, true, false, 0.0},
    {"pnm", VSHI_BITS_8, VSHI_ALPHA_NONE, ANY_SIZE, false, false, 0.0},
    {"webp", VSHI_BITS_8, VSHI_ALPHA_NONE, 16383, true, false, 2.2},
    {"jpeg2000", BITS_8_16, VSHI_ALPHA_KEPT, ANY_SIZE, false, false, 7.0},
    {"dpx", BITS_ALL, VSHI_ALPHA_KEPT, ANY_SIZE, false, false, 1.0},
    {"gif", VSHI_BITS_8, VSHI_ALPHA_NONE, 65535, true, false, 8.2},
    {"sgi", BITS_8_16, VSHI_ALPHA_KEPT, 65534, false, false, 0.0},
    {"iff", VSHI_BITS_8, VSHI_ALPHA_ALWAYS, 8192, false, false, 1.0},
    {"rla", VSHI_BITS_32, VSHI_ALPHA_KEPT, 16383, false, false, 0.0},
    {"ico", VSHI_BITS_8, VSHI_ALPHA_ALWAYS, 255, false, false, 0.0},
    {"heif", VSHI_BITS_8, VSHI_ALPHA_KEPT, 16384, true, false, 6.5},
};

// Endings that OpenImageIO knows and may even write, but not rightly.
constexpr struct {
    const char *ending;
    const char *reason;
} refused[] = {
    {"fits", "OpenImageIO 2.4 puts its rows one too far and its colours along the wrong axis"},
    {"pfm", "OpenImageIO 2.4 only reads it"},
    {"pbm", "it has one bit a pixel"},
    {"zfile", "it holds depth, and a file that is cut short is read as whole"},
    {"j2c", "OpenImageIO 2.4 writes nothing into it; use j2k"},
    {"heics", "it is for sequences of images"},
    {"sxr", "OpenEXR files are to end in .exr"},
    {"mxr", "OpenEXR files are to end in .exr"},
    {"null", "it is no file"},
    {"nul", "it is no file"},
    {"term", "it is no file"},
};

// Read, too. Others are no still images, or have readers that are not for untrusted files: that of iff reads
// what is cut short as whole and writes past its buffers, that of fits takes the row below each.
const char *const readable_only[] = {"cineon", "dds", "psd", "softimage"};
const char *const written_only[] = {"iff"};

constexpr int64_t BAND = int64_t(1) << 20; // values, but a row at least
constexpr int64_t MOST_ROWS = 1024;        // some formats seek for each

} // namespace

std::string ending_of(const char *path) {
    std::string result = vshi_path_ending(path);
    std::transform(result.begin(), result.end(), result.begin(),
                   [](unsigned char c) { return static_cast<char>(c >= 'A' && c <= 'Z' ? c + 32 : c); });
    return result;
}

// Out of "tiff:tif,tiff,tx;jpeg:jpg,…".
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

bool is_readable(const std::string &name) {
    const auto same = [&](const char *other) { return name == other; };
    const auto is = [&](const vshi_format &format) { return name == format.name; };
    return std::any_of(std::begin(readable_only), std::end(readable_only), same) ||
           (std::any_of(std::begin(writable), std::end(writable), is) &&
            std::none_of(std::begin(written_only), std::end(written_only), same));
}

int rows_of_band(int64_t width, int64_t height, int64_t count) {
    return static_cast<int>(std::clamp<int64_t>(BAND / (width * count), 1, std::min(height, MOST_ROWS)));
}

const char *refusal_of(const char *path) {
    const char *reason = nullptr;
    guard(nullptr, VSH_ERROR_INTERNAL, path, [&]() -> vsh_result {
        const std::string ending = ending_of(path);
        for (const auto &entry : refused) {
            reason = ending == entry.ending ? entry.reason : reason;
        }
        return VSH_OK;
    });
    return reason;
}

bool find_format(const char *path, vshi_format *format) {
    bool found = false;
    if (refusal_of(path) != nullptr) {
        return false;
    }
    guard(nullptr, VSH_ERROR_INTERNAL, path, [&]() -> vsh_result {
        const std::string ending = ending_of(path);
        const std::string name = format_of_ending(ending);
        for (const vshi_format &entry : writable) {
            if (name == entry.name) {
                *format = entry;
                format->grey = ending == "pgm";
                found = true;
            }
        }
        return VSH_OK;
    });
    return found;
}

} // namespace vshi
