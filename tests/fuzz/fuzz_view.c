/* Pages of any mesh file, with any names: a page is written whole, or a reason is given. Names stay within
 * the text that the page's script reads. They add no script. The first byte chooses the format, the second
 * how many of the bytes are a name. */
#include "fuzz.h"

#include <vdbshade/picture.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { MOST_PAGE = 64 << 20, OWN_SCRIPTS = 64 };

static size_t count_of(const char *text, const char *what) {
    size_t count = 0;
    for (const char *at = text; (at = strstr(at, what)) != NULL; at += strlen(what)) {
        ++count;
    }
    return count;
}

/* The page as text; it holds no byte of 0. */
static char *read_page(const char *path) {
    FILE *file = fopen(path, "rb");
    char *text = malloc(MOST_PAGE);
    FUZZ_REQUIRE(file != NULL && text != NULL);
    const size_t size = fread(text, 1, MOST_PAGE - 1, file);
    text[size] = '\0';
    fclose(file);
    FUZZ_REQUIRE(strlen(text) == size);
    return text;
}

static void check_page(const char *path) {
    static const char about[] = "<script type=\"application/json\" id=\"about\">";
    static size_t own; /* scripts of a page but for its data: the same for all */
    char *text = read_page(path);
    const char *begin = strstr(text, about);
    /* JSON leaves no line break in a name, so that none ends the text in which it stands. */
    FUZZ_REQUIRE(begin != NULL && strncmp(strchr(begin + 1, '<'), "</script>\n<script>", 18) == 0);
    const size_t scripts = count_of(text, "<script>");
    own = own == 0 ? scripts : own;
    FUZZ_REQUIRE(scripts == own && scripts <= OWN_SCRIPTS);
    FUZZ_REQUIRE(strcmp(text + strlen(text) - 15, "</body></html>\n") == 0);
    free(text);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static const char *const names[] = {"a.gltf", "a.glb", "a.obj", "a.ply", "a.stl"};
    if (size < 2 || size < 2 + (size_t)data[1]) {
        return 0;
    }
    char name[256], output[1024], planes_file[1024];
    memcpy(name, data + 2, data[1]);
    name[data[1]] = '\0';
    const char *path =
        fuzz_file(names[data[0] % (sizeof names / sizeof names[0])], data + 2 + data[1], size - 2 - data[1]);
    snprintf(output, sizeof output, "%s/page.html", fuzz_folder());
    const float values[4] = {0.0f, 0.25f, 1.0f, 2.0f}, *const planes[] = {values, values};
    const char *const channels[] = {name[0] != '\0' ? name : "shadow", "A"};
    const vsh_image image = {2, 2, 2, channels, planes, NULL};
    vsh_view_bake bake = vsh_view_bake_default(), other = vsh_view_bake_default();
    const char *const files[] = {planes_file};
    snprintf(planes_file, sizeof planes_file, "%s/planes.exr", fuzz_folder());
    bake.model = path;
    bake.name = name;
    other.planes = files;
    other.plane_count = 1;
    other.name = name;
    const vsh_run run = fuzz_run();
    if (vsh_image_write(planes_file, &image, NULL, NULL) != VSH_OK) {
        return 0; /* a name that no channel can have */
    }
    const vsh_result result = fuzz_check_plain(vsh_view_write(output, &bake, &other, &run, fuzz_error()));
    if (result == VSH_OK) {
        check_page(output);
    }
    FUZZ_REQUIRE((unlink(output) == 0) == (result == VSH_OK));
    return 0;
}
