// EXR files as other programs see them: read by OpenImageIO, with no code of ours.
#include <cmath>
#include <cstdio>
#include <string>
#include <unistd.h>
#include <vector>

#include <vdbshade/image.h>

#include <OpenImageIO/imageio.h>

#include "testing.h"

namespace {

constexpr int WIDTH = 37, HEIGHT = 50; // several chunks, the last cut

float value_at(size_t channel, size_t texel) {
    return static_cast<float>((texel * 7 + channel * 13) % 101) / 128.0F;
}

// An image of these channels is written, and read whole: names in file order, values by name.
struct Seen {
    int subimages = 0;
    std::vector<std::string> names;
    std::vector<float> values; // interleaved
    OIIO::TypeDesc type;
    std::string rgb; // attribute

    int find(const std::string &name) const {
        for (size_t c = 0; c < names.size(); ++c) {
            if (names[c] == name) {
                return static_cast<int>(c);
            }
        }
        return -1;
    }
    float at(const std::string &name, size_t texel) const {
        return values[texel * names.size() + static_cast<size_t>(find(name))];
    }
};

Seen write_and_see(const std::vector<const char *> &names, const char *pack, int32_t bits) {
    const std::string path = "picture-" + std::to_string(getpid()) + ".exr";
    std::vector<std::vector<float>> planes(names.size(), std::vector<float>(WIDTH * HEIGHT));
    std::vector<const float *> views;
    for (size_t c = 0; c < names.size(); ++c) {
        for (size_t i = 0; i < planes[c].size(); ++i) {
            planes[c][i] = value_at(c, i);
        }
        views.push_back(planes[c].data());
    }
    const vsh_image image = {WIDTH,        HEIGHT,       static_cast<int32_t>(names.size()),
                             names.data(), views.data(), NULL};
    vsh_image_options options = vsh_image_options_default();
    options.pack = pack;
    options.bits = bits;
    vsh_error error;
    if (vsh_image_write(path.c_str(), &image, &options, &error) != VSH_OK) {
        fail_msg("%s", error.message);
    }
    Seen seen;
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

void assert_names(const Seen &seen, const std::vector<const char *> &names) {
    assert_int_equal(seen.names.size(), names.size());
    for (size_t c = 0; c < names.size(); ++c) {
        assert_string_equal(seen.names[c].c_str(), names[c]);
    }
    assert_int_equal(seen.subimages, 1);
}

TEST(rgba_come_first_and_the_named_channels_stay) {
    const Seen seen = write_and_see({"shadow.sun", "ao", "A"}, nullptr, 0);
    assert_names(seen, {"R", "G", "B", "A", "ao", "shadow.sun"});
    assert_true(seen.type == OIIO::TypeDesc::FLOAT);
    assert_string_equal(seen.rgb.c_str(), "shadow.sun * ao");
    for (size_t i = 0; i < WIDTH * HEIGHT; ++i) {
        assert_true(seen.at("shadow.sun", i) == value_at(0, i));
        assert_true(seen.at("ao", i) == value_at(1, i));
        assert_true(seen.at("A", i) == value_at(2, i));
        for (const char *name : {"R", "G", "B"}) {
            assert_true(seen.at(name, i) == value_at(0, i) * value_at(1, i));
        }
    }
}

TEST(the_picture_is_what_there_is) {
    const struct {
        std::vector<const char *> names;
        const char *rgb;
        float (*red)(size_t);
    } cases[] = {
        {{"ao", "A"}, "ao", [](size_t i) { return value_at(0, i); }},
        {{"shadow.a", "A"}, "shadow.a", [](size_t i) { return value_at(0, i); }},
        {{"shadow.a", "shadow.b", "A"},
         "mean of 2 shadows",
         [](size_t i) { return (value_at(0, i) + value_at(1, i)) / 2.0F; }},
        {{"shadow.a", "shadow.b", "ao", "A"},
         "mean of 2 shadows * ao",
         [](size_t i) { return (value_at(0, i) + value_at(1, i)) / 2.0F * value_at(2, i); }},
        {{"shadow.a", "ao", "irradiance.R", "irradiance.G", "irradiance.B", "A"},
         "irradiance",
         [](size_t i) { return value_at(2, i); }},
    };
    for (const auto &one : cases) {
        const Seen seen = write_and_see(one.names, nullptr, 32);
        assert_int_equal(seen.names.size(), one.names.size() + 3);
        assert_string_equal(seen.rgb.c_str(), one.rgb);
        for (size_t i = 0; i < WIDTH * HEIGHT; ++i) {
            assert_true(seen.at("R", i) == one.red(i));
        }
    }
    const Seen colors = write_and_see({"irradiance.B", "irradiance.G", "irradiance.R"}, nullptr, 32);
    assert_true(colors.at("B", 5) == value_at(0, 5) && colors.at("R", 5) == value_at(2, 5));
}

TEST(other_channels_make_no_picture) {
    assert_names(write_and_see({"depth", "A"}, nullptr, 32), {"A", "depth"});
    const Seen own = write_and_see({"R", "G", "B", "shadow.sun"}, nullptr, 32);
    assert_names(own, {"R", "G", "B", "shadow.sun"}); // which it had itself
    assert_true(own.at("R", 3) == value_at(0, 3));
    assert_string_equal(own.rgb.c_str(), "");
}

TEST(a_pack_chooses_picture_or_channels) {
    const Seen picture = write_and_see({"shadow.sun", "ao", "A"}, "rgb", 32);
    assert_names(picture, {"R", "G", "B", "A"});
    assert_true(picture.at("G", 4) == value_at(0, 4) * value_at(1, 4));
    assert_names(write_and_see({"shadow.sun", "ao", "A"}, "channels", 32), {"A", "ao", "shadow.sun"});
}

TEST(half_floats_are_half_all_over) {
    const Seen seen = write_and_see({"shadow.sun", "A"}, nullptr, 16);
    assert_names(seen, {"R", "G", "B", "A", "shadow.sun"});
    assert_true(seen.type == OIIO::TypeDesc::HALF);
    assert_true(std::fabs(seen.at("B", 9) - value_at(0, 9)) <= 0x1p-12F);
}

TEST(a_picture_of_nothing_is_refused) {
    const char *const names[] = {"depth"};
    const vsh_image image = {2, 2, 1, names, nullptr, NULL};
    vsh_image_options options = vsh_image_options_default();
    options.pack = "rgb";
    vsh_error error;
    assert_int_equal(vsh_image_check("x.exr", &image, &options, &error), VSH_ERROR_ARGUMENT);
    options.pack = "channels";
    assert_int_equal(vsh_image_check("x.png", &image, &options, &error), VSH_ERROR_ARGUMENT);
    assert_non_null(std::string(error.message).find("cannot name channels") != std::string::npos ? &error
                                                                                                 : nullptr);
}

} // namespace

int main() {
    return run_all_tests(nullptr, nullptr);
}
