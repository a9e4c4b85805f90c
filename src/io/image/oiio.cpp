// The module of image formats: all but OpenEXR and PNG. A table lists the formats that keep data with
// OpenImageIO 2.4, because OpenImageIO accepts others too. docs/formats.md lists them.
#include "io/image/image.h"

#include "base/file.h"
#include "base/guard.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <fcntl.h>
#include <limits>
#include <memory>
#include <string>
#include <strings.h>
#include <type_traits>
#include <unistd.h>
#include <vector>

namespace {

using vshi::guard;

// --- formats

constexpr int32_t BITS_ALL = VSHI_BITS_8 | VSHI_BITS_16 | VSHI_BITS_32;
constexpr int32_t ANY_SIZE = INT_MAX;

struct Format {
    const char *ending;
    vshi_format format; // its name is OpenImageIO's
};

// Formats without bits can be read, but not written. Sizes are the formats' own limits; jpeg's is lower,
// because libjpeg ends the process above its own. webp drops the colour of transparent pixels, so it counts
// as a format without alpha. `held` comes from measured peak memory: 4096² pixels, written eight rows at a
// time. OpenImageIO 2.4 knows more formats, but does not tell if a disk is full, or reads cut files as whole.
constexpr vshi_format TIFF = {"tiff", BITS_ALL, true, false, ANY_SIZE, 0.0};
constexpr vshi_format JPEG = {"jpeg", VSHI_BITS_8, false, false, 65500, 0.3};
constexpr Format formats[] = {
    // ending, then name, bits, alpha, named, size, held
    {"tif", TIFF},
    {"tiff", TIFF},
    {"jpg", JPEG},
    {"jpeg", JPEG},
    {"tga", {"targa", VSHI_BITS_8, true, false, 65535, 0.0}},
    {"bmp", {"bmp", VSHI_BITS_8, true, false, 1000000, 0.0}},
    {"hdr", {"hdr", VSHI_BITS_32, false, false, ANY_SIZE, 0.0}},
    {"ppm", {"pnm", VSHI_BITS_8, false, false, ANY_SIZE, 0.0}},
    {"webp", {"webp", VSHI_BITS_8, false, false, 16383, 2.2}},
    {"pgm", {"pnm", 0, false, false, 0, 0.0}},
    {"pnm", {"pnm", 0, false, false, 0, 0.0}},
    {"pfm", {"pnm", 0, false, false, 0, 0.0}},
    {"dds", {"dds", 0, false, false, 0, 0.0}},
    {"gif", {"gif", 0, false, false, 0, 0.0}},
    {"heic", {"heif", 0, false, false, 0, 0.0}},
    {"avif", {"heif", 0, false, false, 0, 0.0}},
    {"jp2", {"jpeg2000", 0, false, false, 0, 0.0}},
    {"psd", {"psd", 0, false, false, 0, 0.0}},
};

constexpr int64_t BAND = int64_t(1) << 20; // values, at least a row
constexpr int64_t MOST_ROWS = 1024;        // some formats seek for each row

// Returns the format of a path's ending, of any case, or nullptr.
const vshi_format *format_of(const char *path) {
    for (const Format &entry : formats) {
        if (strcasecmp(vshi_path_ending(path), entry.ending) == 0) {
            return &entry.format;
        }
    }
    return nullptr;
}

// Returns the number of rows that OpenImageIO gets at a time.
int count_band_rows(int64_t width, int64_t height, int64_t count) {
    return static_cast<int>(std::clamp<int64_t>(BAND / (width * count), 1, std::min(height, MOST_ROWS)));
}

bool find_format(const char *path, vshi_format *format) {
    const vshi_format *found = format_of(path);
    *format = found != nullptr ? *found : vshi_format{};
    return format->bits != 0;
}

// --- reading

// The largest end of a data window. OpenImageIO counts rows by int, up to 2^26 beyond the end.
constexpr int64_t LARGEST_END = int64_t(1) << 30;

// Copies rows of the file, which are interleaved, into the planes of the image.
vsh_result read_rows(OIIO::ImageInput &input, const char *path, vsh_image_file &image, vshi_job *job,
                     vsh_error *error) {
    const OIIO::ImageSpec &spec = input.spec();
    const bool tiled = spec.tile_width > 0;
    const int step =
        tiled ? spec.tile_height : count_band_rows(image.width, image.height, image.channel_count);
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
        VSHI_TRY(vshi_job_step(job, static_cast<size_t>(step), error));
    }
    return VSH_OK;
}

vsh_result read_file(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                     vsh_image_file **file, vsh_error *error) {
    const vshi_format *format = bytes == nullptr ? format_of(path) : nullptr;
    if (bytes == nullptr && format == nullptr) {
        return vshi_fail(error, VSH_ERROR_INPUT, "%s: ending '%s': no image format that is read", path,
                         vshi_path_ending(path));
    }
    const std::string name = bytes != nullptr ? bytes->format : format->name;
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
    VSHI_TRY(vshi_job_open(&begun, run, "load", static_cast<size_t>(image->height), path, error));
    const std::unique_ptr<vshi_job, void (*)(vshi_job *)> job(begun, vshi_job_end);
    VSHI_TRY(read_rows(*input, path, *image, job.get(), error));
    *file = owner.release();
    return VSH_OK;
}

vsh_result read_image(const char *path, const vshi_image_bytes *bytes, const vsh_run *run,
                      vsh_image_file **file, vsh_error *error) {
    *file = nullptr;
    return guard(error, VSH_ERROR_READ, path, [&] { return read_file(path, bytes, run, file, error); });
}

// --- writing

// Replaces OpenImageIO's own files, which ignore the result of the last flush. Its jpeg writer ends the
// process after a failed write.
class CheckedFile final : public OIIO::Filesystem::IOProxy {
  public:
    explicit CheckedFile(const char *path) : IOProxy(path, Write), sink_(vshi_sink_open(path)) {}
    ~CheckedFile() override { finish(); }
    CheckedFile(const CheckedFile &) = delete;
    CheckedFile &operator=(const CheckedFile &) = delete;

    const char *proxytype() const override { return "checked"; } // "file" would promise a FILE *
    void close() override {}                                     // finish() closes
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
        // Keeps a failure for finish() and reports success: otherwise libjpeg ends the process.
        vshi_sink_write(&sink_, data, count, static_cast<uint64_t>(offset));
        return count;
    }
    int error() const { return sink_.error; } // so far
    // Closes the file. Returns the first error, or 0.
    int finish() { return vshi_sink_close(&sink_); }

  private:
    vshi_sink sink_;
};

// Interleaves rows [first, last) of the planes into `rows`.
template <typename Value>
void interleave(const vshi_planes &planes, int32_t first, int32_t last, Value *rows) {
    const size_t width = static_cast<size_t>(planes.width), count = static_cast<size_t>(planes.count);
    const size_t begin = static_cast<size_t>(first) * width;
    const size_t texels = static_cast<size_t>(last - first) * width;
    for (size_t c = 0; c < count; ++c) {
        const vshi_image_plane &plane = planes.planes[c];
        for (size_t i = 0; i < texels; ++i) {
            if constexpr (std::is_same_v<Value, float>) {
                rows[i * count + c] = vshi_plane_at(&planes, &plane, begin + i);
            } else {
                rows[i * count + c] = static_cast<Value>(vshi_quantise(
                    vshi_plane_unit_at(&planes, &plane, begin + i), std::numeric_limits<Value>::max()));
            }
        }
    }
}

OIIO::ImageSpec make_spec(const vshi_planes &planes, const std::string &format, const OIIO::TypeDesc &type) {
    OIIO::ImageSpec spec(planes.width, planes.height, planes.count, type);
    spec.attribute("Software", std::string("vdbshade ") + vsh_version());
    spec.attribute("oiio:UnassociatedAlpha", 1); // else colours are divided by alpha
    if (format == "tiff") {
        spec.attribute("DateTime", "1970:01:01 00:00:00"); // fixed: same input, same bytes
    }
    spec.attribute("oiio:BitsPerSample", static_cast<int>(type.size()) * 8);
    if (format == "jpeg") {
        // R, G and B may be unrelated data, which chroma subsampling would mix
        spec.attribute("compression", "jpeg:95");
        spec.attribute("jpeg:subsampling", "4:4:4");
    } else if (format == "webp") {
        spec.attribute("compression", "webp:100");
    } else if (format == "tiff") {
        spec.attribute("compression", "zip");
        spec.attribute("tiff:write_exif", 0); // there is none, and libtiff 4.5 refuses the empty one
    }
    if (planes.is_srgb && (format == "tiff" || format == "jpeg")) {
        spec.attribute("oiio:ColorSpace", "sRGB"); // not for data: readers would undo the curve
    }
    return spec;
}

// Writes values of `bits` bits through OpenImageIO. This class makes the integers, without alpha or transfer
// curves, and collects rows into bands.
class Writer {
  public:
    Writer(const char *temporary, const char *path, const vshi_format &format, const vshi_planes &planes,
           int32_t bits)
        : temporary_(temporary), path_(path), format_(format), width_(planes.width), height_(planes.height),
          count_(planes.count), type_(bits == 8    ? OIIO::TypeDesc::UINT8
                                      : bits == 16 ? OIIO::TypeDesc::UINT16
                                                   : OIIO::TypeDesc::FLOAT),
          file_(temporary) {}
    const char *path() const { return path_; }

    vsh_result open(const vshi_planes &planes, vsh_error *error) {
        output_ = OIIO::ImageOutput::create(format_.name);
        if (!output_) {
            OIIO::geterror();
            return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO has no %s", path_,
                             format_.name);
        }
        output_->threads(1);
        if (!output_->supports("ioproxy") || !output_->set_ioproxy(&file_)) {
            return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO cannot write %s safely",
                             path_, format_.name);
        }
        if (!output_->open(temporary_, make_spec(planes, format_.name, type_))) {
            return fail(error, reason(output_->geterror()));
        }
        if (output_->spec().format != type_ || output_->spec().nchannels != count_) {
            return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO writes %s as %d × %s only",
                             path_, format_.name, output_->spec().nchannels, output_->spec().format.c_str());
        }
        step_ = count_band_rows(width_, height_, count_);
        rows_.resize(row_bytes() * static_cast<size_t>(step_));
        return VSH_OK;
    }

    vsh_result add(const vshi_planes &planes, int32_t rows, vsh_error *error) {
        for (int32_t y = 0; y < rows;) {
            const int32_t count = std::min(rows - y, step_ - filled_);
            unsigned char *to = rows_.data() + static_cast<size_t>(filled_) * row_bytes();
            switch (type_.size()) {
            case 1:
                interleave(planes, y, y + count, to);
                break;
            case 2:
                interleave(planes, y, y + count, reinterpret_cast<uint16_t *>(to));
                break;
            default:
                interleave(planes, y, y + count, reinterpret_cast<float *>(to));
            }
            y += count;
            filled_ += count;
            if (filled_ == step_ || row_ + filled_ == height_) {
                VSHI_TRY(flush(error));
            }
        }
        return VSH_OK;
    }

    vsh_result close(vsh_error *error) {
        const bool closed = output_ != nullptr && output_->close();
        const std::string text = output_ != nullptr ? output_->geterror() : "";
        output_.reset();
        const int number = file_.finish();
        if (number == 0 && !closed) {
            return fail(error, reason(text));
        }
        return number == 0 ? VSH_OK : fail(error, std::strerror(number));
    }

  private:
    size_t row_bytes() const {
        return static_cast<size_t>(width_) * static_cast<size_t>(count_) * type_.size();
    }

    vsh_result fail(vsh_error *error, const std::string &why) const {
        return vshi_fail(error, VSH_ERROR_WRITE, "%s: could not be written: %s", path_, why.c_str());
    }

    static std::string reason(const std::string &text) {
        return text.empty() ? "the writer gave no reason" : text;
    }

    // The file's error, such as a full disk, is more exact than the writer's message.
    vsh_result flush(vsh_error *error) {
        const int first = row_, last = row_ + filled_;
        row_ = last;
        filled_ = 0;
        const bool done = output_->write_scanlines(first, last, 0, type_, rows_.data());
        if (done && file_.error() == 0) {
            return VSH_OK;
        }
        const std::string text = output_->geterror();
        return fail(error, file_.error() != 0 ? std::strerror(file_.error()) : reason(text));
    }

    const char *const temporary_, *const path_; // the caller's
    const vshi_format format_;
    const int32_t width_, height_, count_;
    const OIIO::TypeDesc type_;
    CheckedFile file_; // declared before output_, whose destructor may use it
    std::unique_ptr<OIIO::ImageOutput> output_;
    std::vector<unsigned char> rows_;
    int32_t step_ = 0, filled_ = 0, row_ = 0;
};

vsh_result begin_file(const char *temporary, const char *path, const vshi_format *format,
                      const vshi_planes *planes, int32_t bits, void **writer, vsh_error *error) {
    return guard(error, VSH_ERROR_WRITE, path, [&]() -> vsh_result {
        auto made = std::make_unique<Writer>(temporary, path, *format, *planes, bits);
        VSHI_TRY(made->open(*planes, error));
        *writer = made.release();
        return VSH_OK;
    });
}

vsh_result add_rows(void *user, const vshi_planes *planes, int32_t rows, vsh_error *error) {
    auto *writer = static_cast<Writer *>(user);
    return guard(error, VSH_ERROR_WRITE, writer->path(), [&] { return writer->add(*planes, rows, error); });
}

vsh_result end_file(void *user, vsh_error *error) {
    const std::unique_ptr<Writer> writer(static_cast<Writer *>(user));
    return writer == nullptr
               ? VSH_OK
               : guard(error, VSH_ERROR_WRITE, writer->path(), [&] { return writer->close(error); });
}

double writer_bytes(const vshi_format *format, const vshi_planes *planes, int32_t bits) {
    const double values = static_cast<double>(planes->width) * planes->height * planes->count;
    const double step = count_band_rows(planes->width, planes->height, planes->count);
    const double rows = step * planes->width * planes->count;
    return (bits / 8) * (4.0 * rows + format->held * values); // 4: our rows, and copies of the format
}

} // namespace

// The module shows this symbol only (module.map).
const vshi_oiio_table vshi_oiio_module = {
    VSHI_VERSION, find_format, {begin_file, add_rows, end_file, writer_bytes}, read_image};
