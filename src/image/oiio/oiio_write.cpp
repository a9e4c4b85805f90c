// Writing every image format but OpenEXR and PNG. Integers are made by us, and no value is multiplied by
// alpha or sent through a transfer curve. Bytes go through a file of ours where the writer takes one; where
// it does not, the file is read again, because those writers do not look whether their bytes arrived.
#include "image/oiio/oiio_verify.h"

#include "base/file.h"
#include "base/try.h"
#include "extern/guard.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <limits>
#include <memory>
#include <string>
#include <type_traits>
#include <unistd.h>
#include <vector>

namespace vshi {

namespace {

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
        // A failure is kept for finish() and not told: libjpeg would end the process.
        vshi_sink_write(&sink_, data, count, static_cast<uint64_t>(offset));
        return count;
    }
    int error() const { return sink_.error; } // so far
    // Closes; the first error of all, or 0.
    int finish() { return vshi_sink_close(&sink_); }

  private:
    vshi_sink sink_;
};

template <typename Value>
Value value_at(const vshi_planes &planes, const vshi_image_plane &plane, size_t at) {
    if constexpr (std::is_same_v<Value, float>) {
        return vshi_plane_at(&planes, &plane, at);
    } else {
        constexpr Value most = std::numeric_limits<Value>::max();
        return static_cast<Value>(vshi_quantise(vshi_plane_unit_at(&planes, &plane, at), most));
    }
}

// Rows [first, last) of the planes, interleaved into `rows`.
template <typename Value>
void interleave(const vshi_planes &planes, int32_t first, int32_t last, Value *rows) {
    const size_t width = static_cast<size_t>(planes.width);
    const size_t count = static_cast<size_t>(planes.count);
    const size_t begin = static_cast<size_t>(first) * width;
    const size_t texels = static_cast<size_t>(last - first) * width;
    for (size_t c = 0; c < count; ++c) {
        const vshi_image_plane &plane = planes.planes[c];
        for (size_t i = 0; i < texels; ++i) {
            rows[i * count + c] = value_at<Value>(planes, plane, begin + i);
        }
    }
}

OIIO::ImageSpec make_spec(const vshi_planes &planes, const char *path, const std::string &format,
                          const OIIO::TypeDesc &type) {
    OIIO::ImageSpec spec(planes.width, planes.height, planes.count, type);
    const std::string software = std::string("vdbshade ") + vsh_version();
    spec.attribute("Software", software);
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
    } else if (format == "heif") { // without loss, but for colours, which it halves the resolution of
        spec.attribute("compression", ending_of(path) == "avif" ? "avif:100" : "heic:100");
    } else if (format == "tiff") {
        spec.attribute("compression", "zip");
        spec.attribute("tiff:write_exif", 0); // there is none, and libtiff 4.5 refuses the empty one
    } else if (format == "sgi") {
        spec.attribute("ImageDescription", software); // else 80 bytes that nobody set
    } else if (format == "rla") {
        spec.attribute("oiio:ColorSpace", "Linear");
    }
    if (planes.is_srgb && (format == "tiff" || format == "jpeg")) {
        spec.attribute("oiio:ColorSpace", "sRGB"); // data says nothing: what it was would be undone
    }
    return spec;
}

std::string reason(const std::string &text) {
    return text.empty() ? "the writer gave no reason" : text;
}

// What a format's header says of the making of the file, and what stands there instead: same input, same
// bytes.
struct Stamp {
    const char *format;
    off_t at;
    std::string text;
};

int clear_stamps(const char *temporary, const char *format) {
    static const Stamp stamps[] = {
        {"rla", 528, std::string("Jan 01 00:00 1970").append(3, '\0')}, // the minute
        {"dpx", 36, std::string(100, '\0')},                            // the temporary file's name
    };
    for (const Stamp &stamp : stamps) {
        if (std::strcmp(format, stamp.format) != 0) {
            continue;
        }
        const int file = ::open(temporary, O_WRONLY | O_CLOEXEC);
        const bool written = file >= 0 && ::pwrite(file, stamp.text.data(), stamp.text.size(), stamp.at) ==
                                              ssize_t(stamp.text.size());
        const int number = written ? 0 : errno;
        if (file >= 0) {
            ::close(file);
        }
        return number;
    }
    return 0;
}

} // namespace

} // namespace vshi

struct vshi_oiio_writer {
    vshi_oiio_writer(const char *where, const char *name, const vshi_format &kind, const vshi_planes &planes)
        : temporary(where), path(name), format(kind), shape(planes) {}
    virtual ~vshi_oiio_writer() = default;
    vshi_oiio_writer(const vshi_oiio_writer &) = delete;
    vshi_oiio_writer &operator=(const vshi_oiio_writer &) = delete;
    virtual vsh_result open(vsh_error *error) = 0;
    virtual vsh_result add(const vshi_planes &planes, int32_t rows, vsh_error *error) = 0;
    virtual vsh_result close(vsh_error *error) = 0;

    const char *const temporary, *const path; // the caller's
    const vshi_format format;
    const vshi_planes shape; // size and number of the planes
};

namespace vshi {

namespace {

// Rows are gathered until there are as many as are handed over at a time, whatever the caller has of them.
template <typename Value> class Writer final : public vshi_oiio_writer {
  public:
    using vshi_oiio_writer::vshi_oiio_writer;

    vsh_result open(vsh_error *error) override {
        output_ = OIIO::ImageOutput::create(format.name);
        if (!output_) {
            OIIO::geterror();
            return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO has no %s", path,
                             format.name);
        }
        output_->threads(1);
        const OIIO::TypeDesc type(oiio_type<Value>());
        if (output_->supports("ioproxy")) {
            file_ = std::make_unique<CheckedFile>(temporary);
            if (!output_->set_ioproxy(file_.get())) {
                return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO cannot write %s safely",
                                 path, format.name);
            }
        }
        if (!output_->open(temporary, make_spec(shape, path, format.name, type))) {
            return fail_write(error, path, reason(output_->geterror()));
        }
        if (output_->spec().format != type || output_->spec().nchannels != shape.count) {
            return vshi_fail(error, VSH_ERROR_UNSUPPORTED, "%s: this OpenImageIO writes %s as %d × %s only",
                             path, format.name, output_->spec().nchannels, output_->spec().format.c_str());
        }
        tiled_ = output_->spec().tile_width > 0; // of a format of tiles only
        const int tile = tiled_ ? output_->spec().tile_height : 1;
        const int step = rows_of_band(shape.width, shape.height, shape.count);
        step_ = std::min((step + tile - 1) / tile * tile, shape.height);
        rows_ = make_rows<Value>(shape, step_);
        return VSH_OK;
    }

    vsh_result add(const vshi_planes &planes, int32_t rows, vsh_error *error) override {
        const size_t values = static_cast<size_t>(shape.width) * static_cast<size_t>(shape.count);
        for (int32_t y = 0; y < rows;) {
            const int32_t count = std::min(rows - y, step_ - filled_);
            Value *first = rows_.data() + static_cast<size_t>(filled_) * values;
            interleave(planes, y, y + count, first);
            for (int32_t row = 0; row < count && file_ == nullptr; ++row) {
                sum_.add(first + static_cast<size_t>(row) * values, values);
            }
            y += count;
            filled_ += count;
            if (filled_ == step_ || row_ + filled_ == shape.height) {
                VSHI_TRY(flush(error));
            }
        }
        return VSH_OK;
    }

    vsh_result close(vsh_error *error) override {
        const bool whole = row_ == shape.height;
        if (row_ == 0 && output_ != nullptr) { // the writer of JPEG 2000 loses its image where no row came
            filled_ = step_;
            flush(nullptr);
        }
        const bool closed = output_ != nullptr && output_->close();
        const std::string text = output_ != nullptr ? output_->geterror() : "";
        output_.reset();
        const int number = file_ != nullptr ? file_->finish() : !closed ? disk_error(temporary) : 0;
        if (number != 0) { // says more than the writer's own words
            return fail_write(error, path, std::strerror(number));
        }
        if (!closed) {
            return fail_write(error, path, reason(text));
        }
        if (!whole) {
            return VSH_OK;
        }
        const int stamped = clear_stamps(temporary, format.name);
        if (stamped != 0) {
            return fail_write(error, path, std::strerror(stamped));
        }
        return file_ != nullptr ? VSH_OK : verify<Value>(temporary, path, format, shape, sum_, error);
    }

  private:
    // A disk that is full says more than the writer's own words.
    vsh_result flush(vsh_error *error) {
        const int first = row_, last = row_ + filled_;
        row_ = last;
        filled_ = 0;
        const bool done =
            tiled_ ? output_->write_tiles(0, shape.width, first, last, 0, 1, oiio_type<Value>(), rows_.data())
                   : output_->write_scanlines(first, last, 0, oiio_type<Value>(), rows_.data());
        if (done && (file_ == nullptr || file_->error() == 0)) {
            return VSH_OK;
        }
        const std::string text = output_->geterror();
        const int number = file_ != nullptr ? file_->error() : disk_error(temporary);
        return fail_write(error, path, number != 0 ? std::strerror(number) : reason(text));
    }

    std::unique_ptr<CheckedFile> file_; // outlives the writer, which may still use it when it goes
    std::unique_ptr<OIIO::ImageOutput> output_;
    std::vector<Value> rows_;
    Sum sum_; // of what has been given, where the file is to be read again
    int32_t step_ = 0, filled_ = 0, row_ = 0;
    bool tiled_ = false;
};

std::unique_ptr<vshi_oiio_writer> make_writer(const char *temporary, const char *path,
                                              const vshi_format &format, const vshi_planes &planes,
                                              int32_t bits) {
    switch (bits) {
    case 8:
        return std::make_unique<Writer<uint8_t>>(temporary, path, format, planes);
    case 16:
        return std::make_unique<Writer<uint16_t>>(temporary, path, format, planes);
    default:
        return std::make_unique<Writer<float>>(temporary, path, format, planes);
    }
}

vsh_result begin_file(const char *temporary, const char *path, const vshi_format *format,
                      const vshi_planes *planes, int32_t bits, vshi_oiio_writer **writer, vsh_error *error) {
    return guard(error, VSH_ERROR_WRITE, path, [&]() -> vsh_result {
        auto made = make_writer(temporary, path, *format, *planes, bits);
        VSHI_TRY(made->open(error));
        *writer = made.release();
        return VSH_OK;
    });
}

vsh_result add_rows(vshi_oiio_writer *writer, const vshi_planes *planes, int32_t rows, vsh_error *error) {
    return guard(error, VSH_ERROR_WRITE, writer->path,
                 [&]() -> vsh_result { return writer->add(*planes, rows, error); });
}

vsh_result end_file(vshi_oiio_writer *writer, vsh_error *error) {
    const std::unique_ptr<vshi_oiio_writer> owned(writer);
    return guard(error, VSH_ERROR_WRITE, writer->path, [&]() -> vsh_result { return writer->close(error); });
}

double writer_bytes(const vshi_format *format, const vshi_planes *planes, int32_t bits) {
    const double values = static_cast<double>(planes->width) * planes->height * planes->count;
    const double step = rows_of_band(planes->width, planes->height, planes->count);
    const double rows = step * planes->width * planes->count;
    return (bits / 8) * (4.0 * rows + format->held * values); // rows: ours, and the format's on their way
}

} // namespace

} // namespace vshi

// Every symbol of the module but this one is hidden (module.map).
const vshi_oiio_table vshi_oiio_module = {VSHI_VERSION,       vshi::find_format, vshi::refusal_of,
                                          vshi::begin_file,   vshi::add_rows,    vshi::end_file,
                                          vshi::writer_bytes, vshi::read_image};
