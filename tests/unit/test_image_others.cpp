// EXR and PNG files as other programs see them, read by OpenImageIO with no code of ours; and EXR files in
// tiles, which this library reads and does not write.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include <OpenImageIO/imageio.h>

#include "testing.h"

#include "base/elementary.h"

namespace {

constexpr int WIDTH = 37, HEIGHT = 50; // several chunks of EXR, the last cut
constexpr size_t TEXELS = WIDTH * HEIGHT;

// Writes an image of these channels; `value` is that of a channel's texel.
void write(const std::string &path, const std::vector<const char *> &names, const vsh_channel_kind *holds,
           float (*value)(size_t channel, size_t texel), const vsh_image_options &options) {
    std::vector<std::vector<float>> planes(names.size(), std::vector<float>(TEXELS));
    std::vector<const float *> views;
    for (size_t c = 0; c < planes.size(); ++c) {
        for (size_t i = 0; i < TEXELS; ++i) {
            planes[c][i] = value(c, i);
        }
        views.push_back(planes[c].data());
    }
    const vsh_image image = {WIDTH,        HEIGHT,       static_cast<int32_t>(names.size()),
                             names.data(), views.data(), holds};
    assert_ok(vsh_image_write(path.c_str(), &image, &options, &failure));
}

// --- EXR

float share_at(size_t channel, size_t texel) {
    return static_cast<float>((texel * 7 + channel * 13) % 101) / 128.0F;
}

// An image of these channels is written, and read whole: names in file order, values by name.
struct SeenExr {
    int subimages = 0;
    std::vector<std::string> names;
    std::vector<float> values; // interleaved
    OIIO::TypeDesc type;
    std::string rgb; // attribute

    float at(const std::string &name, size_t texel) const {
        const auto channel = std::find(names.begin(), names.end(), name) - names.begin();
        return values.at(texel * names.size() + static_cast<size_t>(channel));
    }
};

SeenExr write_exr(const std::vector<const char *> &names, const char *pack, int32_t bits) {
    const std::string path = "picture-" + std::to_string(getpid()) + ".exr";
    vsh_image_options options = vsh_image_options_default();
    options.pack = pack;
    options.bits = bits;
    write(path, names, nullptr, share_at, options);
    SeenExr seen;
    const auto input = OIIO::ImageInput::open(path);
    assert_true(input != nullptr);
    const OIIO::ImageSpec spec = input->spec();
    assert_int_equal(spec.width, WIDTH);
    assert_int_equal(spec.height, HEIGHT);
    seen.names.assign(spec.channelnames.begin(), spec.channelnames.end());
    seen.type = spec.format;
    assert_true(spec.channelformats.empty()); // one type: Krita and old loaders of three.js want it
    seen.rgb = spec.get_string_attribute(VSH_IMAGE_RGB);
    seen.values.resize(static_cast<size_t>(WIDTH) * HEIGHT * seen.names.size());
    assert_true(input->read_image(0, 0, 0, static_cast<int>(seen.names.size()), OIIO::TypeDesc::FLOAT,
                                  seen.values.data()));
    while (input->seek_subimage(seen.subimages, 0)) {
        ++seen.subimages;
    }
    OIIO::geterror();
    std::remove(path.c_str());
    return seen;
}

void assert_names(const SeenExr &seen, const std::vector<const char *> &names) {
    assert_int_equal(seen.names.size(), names.size());
    for (size_t c = 0; c < names.size(); ++c) {
        assert_string_equal(seen.names[c].c_str(), names[c]);
    }
    assert_int_equal(seen.subimages, 1);
}

TEST(rgb_is_made_of_the_channels_that_exist) {
    const struct {
        std::vector<const char *> names;
        const char *rgb;
        float (*red)(size_t);
    } cases[] = {
        {{"shadow.sun", "ao", "A"},
         "shadow.sun * ao",
         [](size_t i) { return share_at(0, i) * share_at(1, i); }},
        {{"ao", "A"}, "ao", [](size_t i) { return share_at(0, i); }},
        {{"shadow.a", "A"}, "shadow.a", [](size_t i) { return share_at(0, i); }},
        {{"shadow.a", "shadow.b", "A"},
         "mean of 2 shadows",
         [](size_t i) { return (share_at(0, i) + share_at(1, i)) / 2.0F; }},
        {{"shadow.a", "shadow.b", "ao", "A"},
         "mean of 2 shadows * ao",
         [](size_t i) { return (share_at(0, i) + share_at(1, i)) / 2.0F * share_at(2, i); }},
        {{"shadow.a", "ao", "irradiance.R", "irradiance.G", "irradiance.B", "A"},
         "irradiance",
         [](size_t i) { return share_at(2, i); }},
    };
    for (const auto &one : cases) {
        const SeenExr seen = write_exr(one.names, nullptr, 0);
        assert_true(seen.type == OIIO::TypeDesc::FLOAT);
        assert_int_equal(seen.names.size(), one.names.size() + 3);
        assert_string_equal(seen.rgb.c_str(), one.rgb);
        for (size_t i = 0; i < WIDTH * HEIGHT; ++i) {
            assert_true(seen.at("R", i) == one.red(i));
            for (size_t c = 0; c < one.names.size(); ++c) {
                assert_true(seen.at(one.names[c], i) == share_at(c, i));
            }
        }
    }
    const SeenExr colors = write_exr({"irradiance.B", "irradiance.G", "irradiance.R"}, nullptr, 32);
    assert_true(colors.at("B", 5) == share_at(0, 5) && colors.at("R", 5) == share_at(2, 5));
}

TEST(other_channels_make_no_picture) {
    assert_names(write_exr({"depth", "A"}, nullptr, 32), {"A", "depth"});
    const SeenExr own = write_exr({"R", "G", "B", "shadow.sun"}, nullptr, 32);
    assert_names(own, {"R", "G", "B", "shadow.sun"}); // which it had itself
    assert_true(own.at("R", 3) == share_at(0, 3));
    assert_string_equal(own.rgb.c_str(), "");
}

TEST(a_pack_chooses_picture_or_channels) {
    const SeenExr picture = write_exr({"shadow.sun", "ao", "A"}, "rgb", 32);
    assert_names(picture, {"R", "G", "B", "A"});
    assert_true(picture.at("G", 4) == share_at(0, 4) * share_at(1, 4));
    assert_names(write_exr({"shadow.sun", "ao", "A"}, "channels", 32), {"A", "ao", "shadow.sun"});
}

TEST(half_floats_are_half_all_over) {
    const SeenExr seen = write_exr({"shadow.sun", "A"}, nullptr, 16);
    assert_names(seen, {"R", "G", "B", "A", "shadow.sun"});
    assert_true(seen.type == OIIO::TypeDesc::HALF);
    assert_true(std::fabs(seen.at("B", 9) - share_at(0, 9)) <= 0x1p-12F);
}

TEST(a_picture_of_nothing_is_refused) {
    const char *const names[] = {"depth"};
    const vsh_image image = {2, 2, 1, names, nullptr, NULL};
    vsh_image_options options = vsh_image_options_default();
    options.pack = "rgb";
    assert_fails(vsh_image_check("x.exr", &image, &options, &failure), VSH_ERROR_ARGUMENT, "");
    options.pack = "channels";
    assert_fails(vsh_image_check("x.png", &image, &options, &failure), VSH_ERROR_ARGUMENT,
                 "cannot name channels");
}

// --- PNG

// Values from -0.25 to 1.5, NaN, and both infinities.
float value_at(size_t channel, size_t texel) {
    const size_t n = (texel * 7 + channel * 13) % 229;
    return n == 226   ? std::numeric_limits<float>::quiet_NaN()
           : n == 227 ? std::numeric_limits<float>::infinity()
           : n == 228 ? -std::numeric_limits<float>::infinity()
                      : static_cast<float>(n) / 129.0F - 0.25F;
}

struct Seen {
    OIIO::ImageSpec spec;
    std::string chunks;           // their types, in the order of the file: OpenImageIO takes some for granted
    std::vector<uint16_t> values; // interleaved, as they stand in the file
};

std::string chunks_of(const std::string &path) {
    std::ifstream file(path, std::ios::binary);
    std::string types;
    unsigned char head[8];
    file.ignore(8); // the signature
    while (file.read(reinterpret_cast<char *>(head), sizeof head)) {
        types += std::string(reinterpret_cast<const char *>(head) + 4, 4) + " ";
        file.ignore((head[0] << 24 | head[1] << 16 | head[2] << 8 | head[3]) + 4); // and its checksum
    }
    return types;
}

struct Asked {
    std::vector<const char *> names;
    const char *pack = nullptr;
    int32_t bits = 8;
    std::vector<vsh_channel_kind> holds = {}; // none: data
    vsh_color_space color_space = VSH_COLOR_AUTO;
    std::vector<vsh_attribute> attributes = {};
};

Seen write_and_see(const Asked &asked) {
    const std::string path = "png-" + std::to_string(getpid()) + ".png";
    vsh_image_options options = vsh_image_options_default();
    options.pack = asked.pack;
    options.bits = asked.bits;
    options.color_space = asked.color_space;
    options.attributes = asked.attributes.data();
    options.attribute_count = asked.attributes.size();
    write(path, asked.names, asked.holds.empty() ? nullptr : asked.holds.data(), value_at, options);
    const auto input = OIIO::ImageInput::create("png");
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1); // else OpenImageIO multiplies colours by it
    Seen seen;
    assert_true(input != nullptr && input->open(path, seen.spec, config));
    assert_int_equal(seen.spec.width, WIDTH);
    assert_int_equal(seen.spec.height, HEIGHT);
    assert_true(seen.spec.format == (asked.bits == 8 ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::UINT16));
    const size_t count = TEXELS * static_cast<size_t>(seen.spec.nchannels);
    seen.values.resize(count);
    if (asked.bits == 16) {
        assert_true(
            input->read_image(0, 0, 0, seen.spec.nchannels, OIIO::TypeDesc::UINT16, seen.values.data()));
    } else {
        std::vector<uint8_t> bytes(count);
        assert_true(input->read_image(0, 0, 0, seen.spec.nchannels, OIIO::TypeDesc::UINT8, bytes.data()));
        std::copy(bytes.begin(), bytes.end(), seen.values.begin());
    }
    seen.chunks = chunks_of(path);
    std::remove(path.c_str());
    return seen;
}

double as_it_is(double value) {
    return value;
}

double half_and_half(double value) {
    return 0.5 + 0.5 * value;
}

double srgb(double value) { // IEC 61966-2-1
    return value <= 0.0031308 ? 12.92 * value : 1.055 * std::pow(value, 1.0 / 2.4) - 0.055;
}

// A channel of the file is one of the image, -1 for zeros or -2 for ones.
void assert_channel(const Seen &seen, size_t at, int channel, int32_t bits, double (*curve)(double)) {
    const size_t count = static_cast<size_t>(seen.spec.nchannels);
    const double most = bits == 8 ? 255.0 : 65535.0;
    for (size_t i = 0; i < TEXELS; ++i) {
        const auto value = static_cast<double>(channel >= 0 ? value_at(static_cast<size_t>(channel), i)
                                                            : static_cast<float>(-1 - channel));
        const double cut = value > 0.0 || curve == half_and_half ? std::min(value, 1.0) : 0.0;
        const double expected = std::floor(std::clamp(curve(cut), 0.0, 1.0) * most + 0.5);
        const double found = seen.values[i * count + at];
        if (!(found == (std::isnan(value) ? 0.0 : expected))) {
            fail_msg("channel %zu, texel %zu: %g is %g, expected %g", at, i, value, found, expected);
        }
        assert_true(curve != srgb || std::isnan(value) ||
                    std::fabs(vshi_from_srgb(found / most) - cut) <= 1.2 / most);
    }
}

TEST(values_are_those_that_were_given) {
    for (const int32_t bits : {8, 16}) {
        const Seen three = write_and_see({{"shadow.sun", "ao"}, "R=ao,B=shadow.sun", bits});
        assert_int_equal(three.spec.nchannels, 3);
        const Seen four = write_and_see({{"shadow.sun", "ao", "A"}, "R=shadow.sun,G=ao,B=1,A=A", bits});
        assert_int_equal(four.spec.nchannels, 4);
        assert_int_equal(four.spec.alpha_channel, 3);
        for (size_t c = 0; c < 4; ++c) { // colours are not multiplied by alpha, which is 0 at places
            const int from[2][4] = {{1, -1, 0}, {0, 1, -2, 2}};
            if (c < 3) {
                assert_channel(three, c, from[0][c], bits, as_it_is);
            }
            assert_channel(four, c, from[1][c], bits, as_it_is);
        }
    }
    const Seen bent = write_and_see({{"bent.x", "bent.y", "bent.z"},
                                     "R=bent.x,G=bent.y,B=bent.z",
                                     8,
                                     {VSH_CHANNEL_VECTOR, VSH_CHANNEL_VECTOR, VSH_CHANNEL_VECTOR}});
    for (size_t c = 0; c < 3; ++c) {
        assert_channel(bent, c, static_cast<int>(c), 8, half_and_half);
    }
}

// The kind of a channel, not its name, decides how it is coded; alpha is linear. Programs would undo a gamma
// chunk, or one of colours, in data.
TEST(light_is_srgb_and_says_so_and_all_else_is_linear_unless_a_space_is_named) {
    const std::vector<vsh_channel_kind> light = {VSH_CHANNEL_DATA, VSH_CHANNEL_LIGHT, VSH_CHANNEL_LIGHT,
                                                 VSH_CHANNEL_LIGHT, VSH_CHANNEL_DATA};
    const struct {
        std::vector<vsh_channel_kind> holds;
        const char *pack;
        int32_t bits;
        vsh_color_space space;
        int from; // the channel of the image in R
        double (*curve)(double);
        const char *said;
    } cases[] = {
        {light, nullptr, 8, VSH_COLOR_AUTO, 1, srgb, "sRGB"},
        {light, nullptr, 16, VSH_COLOR_AUTO, 1, srgb, "sRGB"},
        {light, "R=shadow.sun,A=A", 8, VSH_COLOR_AUTO, 0, as_it_is, "linear"},
        {light, "R=shadow.sun,G=irradiance.G,A=A", 8, VSH_COLOR_AUTO, 0, as_it_is, "linear"},
        {light, "rgb", 8, VSH_COLOR_AUTO, 1, srgb, "sRGB"}, // the picture is the irradiance
        {light, nullptr, 8, VSH_COLOR_LINEAR, 1, as_it_is, "linear"},
        {light, nullptr, 16, VSH_COLOR_LINEAR, 1, as_it_is, "linear"},
        {light, "R=shadow.sun,A=A", 16, VSH_COLOR_SRGB, 0, srgb, "sRGB"},
        {light, "R=shadow.sun,A=A", 16, VSH_COLOR_ENCODED, 0, as_it_is, "sRGB"}, // the values stay
        {{}, nullptr, 16, VSH_COLOR_AUTO, 1, as_it_is, "linear"},
    };
    for (const auto &one : cases) {
        const Seen seen = write_and_see({{"shadow.sun", "irradiance.R", "irradiance.G", "irradiance.B", "A"},
                                         one.pack,
                                         one.bits,
                                         one.holds,
                                         one.space});
        assert_int_equal(seen.spec.nchannels, 4);
        for (int c = 0; c < (one.from == 1 ? 3 : 1); ++c) {
            assert_channel(seen, size_t(c), one.from + c, one.bits, one.curve);
        }
        assert_channel(seen, 3, 4, one.bits, as_it_is);
        assert_string_equal(seen.spec.get_string_attribute("vdbshade_color_space").c_str(), one.said);
        const char *chunks = one.said[0] == 's' ? "IHDR gAMA sRGB cHRM tEXt " : "IHDR tEXt tEXt IDAT ";
        assert_true(seen.chunks.rfind(chunks, 0) == 0);
    }
}

// Once each, in any script, and as long as they may be.
TEST(texts_are_those_that_were_given) {
    const std::string software = std::string("vdbshade ") + vsh_version(), longest(65535, 'x'), name(79, 'n');
    Asked asked = {{"shadow.sun"}};
    asked.attributes = {{"vdbshade_command", "bake größe.obj"},
                        {"vdbshade_color_space", "none of the caller's"},
                        {"empty", ""},
                        {name.c_str(), longest.c_str()}};
    const Seen seen = write_and_see(asked);
    assert_string_equal(seen.spec.get_string_attribute("Software").c_str(), software.c_str());
    assert_string_equal(seen.spec.get_string_attribute("vdbshade_command").c_str(), "bake größe.obj");
    assert_string_equal(seen.spec.get_string_attribute("vdbshade_color_space").c_str(), "linear");
    assert_true(seen.spec.get_string_attribute(name) == longest);
    assert_true(seen.chunks.rfind("IHDR tEXt tEXt tEXt tEXt tEXt IDAT ", 0) == 0);
    asked.attributes = {{"Software", "a host of ours"}};
    const Seen other = write_and_see(asked);
    assert_string_equal(other.spec.get_string_attribute("Software").c_str(), "a host of ours");
    assert_true(other.chunks.rfind("IHDR tEXt tEXt IDAT ", 0) == 0);
}

TEST(the_longest_row_is_written) {
    std::vector<float> plane(1000000, 0.25F);
    const char *name = "shadow.sun", *const path = "png-long.png";
    const float *view = plane.data();
    vsh_image image = {1000000, 1, 1, &name, &view, NULL};
    assert_ok(vsh_image_write(path, &image, nullptr, &failure));
    const auto input = OIIO::ImageInput::open(path);
    assert_true(input != nullptr && input->spec().width == 1000000);
    std::remove(path);
    image.width = 1000001;
    assert_int_equal(vsh_image_check(path, &image, nullptr, &failure), VSH_ERROR_ARGUMENT);
}

// --- EXR files in tiles

struct Tiling {
    int width, height, tile_width, tile_height, left, top;
    bool levels; // coarser ones hold NaN
};

std::vector<float> write_tiles(const char *path, const Tiling &t) {
    OIIO::ImageSpec spec(t.width, t.height, 2, OIIO::TypeDesc::FLOAT);
    spec.channelnames = {"ao", "shadow"};
    spec.x = t.left;
    spec.y = t.top;
    spec.tile_width = t.tile_width;
    spec.tile_height = t.tile_height;
    spec.attribute("compression", "none");
    spec.attribute("textureformat", t.levels ? "Plain Texture" : "");
    std::vector<float> pixels(2 * size_t(t.width) * size_t(t.height));
    for (size_t i = 0; i < pixels.size(); ++i) {
        pixels[i] = share_at(i % 2, i / 2);
    }
    const auto output = OIIO::ImageOutput::create(path);
    assert_true(output->open(path, spec) && output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()));
    const std::vector<float> none(pixels.size(), NAN);
    while (t.levels && (spec.width > 1 || spec.height > 1)) {
        spec.width = std::max(1, spec.width / 2);
        spec.height = std::max(1, spec.height / 2);
        assert_true(output->open(path, spec, OIIO::ImageOutput::AppendMIPLevel) &&
                    output->write_image(OIIO::TypeDesc::FLOAT, none.data()));
    }
    assert_true(output->close());
    return pixels;
}

TEST(the_finest_level_of_tiles_is_read_to_the_bit) {
    const Tiling tilings[] = {{37, 23, 16, 8, 0, 0, false}, {16, 16, 64, 64, 0, 0, false},
                              {1, 40, 8, 8, 0, 0, false},   {37, 23, 16, 16, -7, 1000, false},
                              {64, 64, 32, 32, 0, 0, true}, {50, 30, 16, 16, 3, -3, true}};
    for (const Tiling &t : tilings) {
        const std::vector<float> pixels = write_tiles("tiles.exr", t);
        OWNED(vsh_image_file) *file = nullptr;
        assert_ok(vsh_image_read("tiles.exr", nullptr, &file, &failure));
        const vsh_image view = vsh_image_view(file);
        assert_true(view.width == t.width && view.height == t.height && view.channel_count == 2);
        assert_string_equal(view.names[0], "ao");
        assert_string_equal(view.names[1], "shadow");
        for (size_t i = 0; i < pixels.size(); ++i) {
            assert_true(view.planes[i % 2][i / 2] == pixels[i]);
        }
    }
}

TEST(reading_tiles_can_be_cancelled_and_cut_files_are_refused) {
    write_tiles("tiles.exr", {40, 64, 16, 16, 0, 0, false});
    vsh_image_file *file = nullptr;
    vsh_run run = vsh_run_default();
    run.progress = [](void *, const char *, double fraction) { return int32_t(fraction >= 0.5); };
    assert_fails(vsh_image_read("tiles.exr", &run, &file, &failure), VSH_ERROR_CANCELLED, "");
    std::ifstream whole("tiles.exr", std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(whole), {}};
    for (const size_t cut : {size_t(1), size_t(100), bytes.size() / 2, bytes.size() - 400}) {
        std::ofstream("tiles.exr", std::ios::binary) << bytes.substr(0, bytes.size() - cut);
        const vsh_result result = vsh_image_read("tiles.exr", nullptr, &file, &failure);
        assert_true(result == VSH_ERROR_INPUT || result == VSH_ERROR_READ);
        assert_non_null(std::strstr(failure.message, "tiles.exr"));
        assert_null(file);
    }
    std::remove("tiles.exr");
}

} // namespace
