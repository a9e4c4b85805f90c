/* Pixels of PNG files, for tests. Usage: picture get FILE X Y …: "R G B" of each, 0 … 255, a line each;
 * picture put FILE WIDTH HEIGHT R G B …: a file of so many pixels, row by row from the top. */
#include <png.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>

static unsigned char pixels[1 << 24];

static unsigned number(const char *text) {
    return (unsigned)strtoul(text, NULL, 10);
}

int main(int argc, char **argv) {
    const bool puts = argv[1][0] == 'p';
    png_image image = {.version = PNG_IMAGE_VERSION, .width = number(argv[3]), .height = number(argv[4])};
    if (!puts && !png_image_begin_read_from_file(&image, argv[2])) {
        return 1;
    }
    image.format = PNG_FORMAT_RGB;
    if (PNG_IMAGE_SIZE(image) > sizeof pixels || (puts && PNG_IMAGE_SIZE(image) != (unsigned)argc - 5)) {
        return 1;
    }
    for (int i = 5; puts && i < argc; ++i) {
        pixels[i - 5] = (unsigned char)number(argv[i]);
    }
    if (puts) {
        return png_image_write_to_file(&image, argv[2], 0, pixels, 0, NULL) ? 0 : 1;
    }
    int failed = png_image_finish_read(&image, NULL, pixels, 0, NULL) ? 0 : 1;
    for (int i = 3; failed == 0 && i + 1 < argc; i += 2) {
        const unsigned x = number(argv[i]), y = number(argv[i + 1]);
        failed = x < image.width && y < image.height ? 0 : 1;
        const unsigned char *p = pixels + (failed == 0 ? 3 * (y * image.width + x) : 0);
        printf("%d %d %d\n", p[0], p[1], p[2]);
    }
    return failed;
}
