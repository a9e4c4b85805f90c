/* Pixels of PNG files, for tests. Usage: picture get FILE X Y …: "R G B" of each, 0 … 255, a line each;
 * picture put FILE WIDTH HEIGHT R G B …: a file of so many pixels, row by row from the top. */
#include <png.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int fail(const char *file, const char *why) {
    fprintf(stderr, "%s: %s\n", file, why);
    return 1;
}

static int get(const char *file, int count, char **numbers) {
    png_image image = {.version = PNG_IMAGE_VERSION};
    if (!png_image_begin_read_from_file(&image, file)) {
        return fail(file, image.message);
    }
    image.format = PNG_FORMAT_RGB;
    unsigned char *pixels = malloc(PNG_IMAGE_SIZE(image));
    if (pixels == NULL || !png_image_finish_read(&image, NULL, pixels, 0, NULL)) {
        free(pixels);
        return fail(file, image.message);
    }
    for (int i = 0; i + 1 < count; i += 2) {
        const unsigned long x = strtoul(numbers[i], NULL, 10), y = strtoul(numbers[i + 1], NULL, 10);
        if (x >= image.width || y >= image.height) {
            free(pixels);
            return fail(file, "no such pixel");
        }
        const unsigned char *p = pixels + 3 * (y * image.width + x);
        printf("%d %d %d\n", p[0], p[1], p[2]);
    }
    free(pixels);
    return 0;
}

static int put(const char *file, int count, char **numbers) {
    if (count < 2) {
        return fail(file, "no size");
    }
    png_image image = {.version = PNG_IMAGE_VERSION,
                       .width = (png_uint_32)strtoul(numbers[0], NULL, 10),
                       .height = (png_uint_32)strtoul(numbers[1], NULL, 10),
                       .format = PNG_FORMAT_RGB};
    if ((size_t)(count - 2) != PNG_IMAGE_SIZE(image)) {
        return fail(file, "another number of values");
    }
    unsigned char *pixels = malloc(PNG_IMAGE_SIZE(image));
    for (int i = 2; pixels != NULL && i < count; ++i) {
        pixels[i - 2] = (unsigned char)strtoul(numbers[i], NULL, 10);
    }
    const int written = pixels != NULL && png_image_write_to_file(&image, file, 0, pixels, 0, NULL);
    free(pixels);
    return written ? 0 : fail(file, image.message);
}

int main(int argc, char **argv) {
    if (argc > 4 && strcmp(argv[1], "get") == 0) {
        return get(argv[2], argc - 3, argv + 3);
    }
    if (argc > 4 && strcmp(argv[1], "put") == 0) {
        return put(argv[2], argc - 3, argv + 3);
    }
    return fail("picture", "get FILE X Y … or put FILE WIDTH HEIGHT R G B …");
}
