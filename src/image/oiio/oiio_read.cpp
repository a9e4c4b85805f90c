// Reading every image format but OpenEXR and PNG.
#include "image/oiio/oiio_formats.h"

#include "base/try.h"
#include "extern/guard.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <memory>

namespace vshi {

namespace {

// The ico reader of OpenImageIO 2.4 writes past its buffer for pictures of fewer than 32 bits, and lets
// libpng print: only bitmaps of 32 bits are given to it.
vsh_result check_ico(const char *path, vsh_error *error) {
    const std::unique_ptr<FILE, int (*)(FILE *)> file(std::fopen(path, "rbe"), std::fclose);
    const auto read = [&](unsigned char *bytes, size_t size) {
        return file != nullptr && std::fread(bytes, size, 1, file.get()) == 1;
    };
    unsigned char head[22], bitmap[16];
    const auto at = [&] { return head[18] | head[19] << 8 | head[20] << 16 | long(head[21]) << 24; };
    if (!read(head, sizeof head) || std::fseek(file.get(), at(), SEEK_SET) != 0 ||
        !read(bitmap, sizeof bitmap)) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: could not be read as ico: cut short", path);
    }
    constexpr unsigned char header_size[4] = {40, 0, 0, 0};
    if (std::memcmp(bitmap, header_size, sizeof header_size) != 0 || bitmap[14] != 32 || bitmap[15] != 0) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED,
                         "%s: icons are read where the first is a bitmap of 32 bits a pixel", path);
    }
    return VSH_OK;
}

// Of a data window: OpenImageIO counts rows by int, and up to 2^26 ahead.
constexpr int64_t LARGEST_END = int64_t(1) << 30;

// Rows of the file, interleaved, into the planes of the image.
vsh_result read_rows(OIIO::ImageInput &input, const char *path, vsh_image_file &image, vshi_job *job,
                     vsh_error *error) {
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
            return vshi_fail(error, VSH_ERROR_READ, "%s: could not be read at row %d: %s", path,
                             static_cast<int>(y), input.geterror().c_str());
        }
        const size_t begin = static_cast<size_t>(y) * width;
        for (size_t c = 0; c < count; ++c) {
            float *plane = image.values + c * texels + begin;
            for (size_t i = 0; i < (static_cast<size_t>(last) * width - begin); ++i) {
                plane[i] = rows[i * count + c];
            }
        }
        if (vshi_job_advance(job, static_cast<size_t>(step))) {
            return vshi_job_fail_cancelled(job, error);
        }
    }
    return VSH_OK;
}

vsh_result read_file(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                     vsh_image_file **file, vsh_error *error) {
    const std::string ending = bytes != nullptr ? bytes->format : ending_of(path);
    const std::string name = bytes != nullptr ? bytes->format : format_of_ending(ending);
    if (!is_readable(name)) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: ending '%s': no image format that is read", path,
                         ending.c_str());
    }
    const vsh_result safe = name == "ico" ? check_ico(path, error) : VSH_OK;
    if (safe != VSH_OK) {
        return safe;
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
    std::unique_ptr<OIIO::Filesystem::IOMemReader> memory;
    if (bytes != nullptr) {
        if (input->supports("ioproxy") == 0) {
            return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO reads %s from files alone",
                             path, name.c_str());
        }
        memory = std::make_unique<OIIO::Filesystem::IOMemReader>(const_cast<void *>(bytes->at), bytes->size);
        OIIO::Filesystem::IOProxy *proxy = memory.get();
        config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
    }
    OIIO::ImageSpec spec;
    if (!input->open(path, spec, config)) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: could not be read as %s: %s", path, name.c_str(),
                         input->geterror().c_str());
    }
    if (spec.deep || spec.depth > 1) {
        return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: deep and volume images are not read", path);
    }
    const int64_t ends[] = {int64_t(spec.x) + spec.width, int64_t(spec.y) + spec.height, int64_t(spec.z) + 1};
    if (*std::max_element(ends, ends + 3) > LARGEST_END) {
        return vshi_fail(error, VSH_ERROR_READ, "%s: its data window begins at (%d, %d, %d): damaged", path,
                         spec.x, spec.y, spec.z);
    }
    vsh_image_file *image = nullptr;
    VSHI_TRY(vshi_image_file_new(path, run, spec.width, spec.height, spec.nchannels, &image, error));
    std::unique_ptr<vsh_image_file, void (*)(vsh_image_file *)> owner(image, vsh_image_free);
    for (int32_t c = 0; c < image->channel_count; ++c) {
        vshi_image_file_name(image, c, std::string(spec.channel_name(c)).c_str());
    }
    vshi_job *begun = nullptr;
    VSHI_TRY(vshi_image_job(path, run, image->height, &begun, error));
    const std::unique_ptr<vshi_job, void (*)(vshi_job *)> job(begun, vshi_job_end);
    VSHI_TRY(read_rows(*input, path, *image, job.get(), error));
    *file = owner.release();
    return VSH_OK;
}

} // namespace

vsh_result read_image(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                      vsh_image_file **file, vsh_error *error) {
    *file = nullptr;
    return guard(error, VSH_ERROR_READ, path, [&] { return read_file(path, bytes, run, file, error); });
}

} // namespace vshi
