#include "cli/message.h"
#include "info.h"

#include <math.h>
#include <stdio.h>
#include <vdbshade/image.h>

static void print_channel(const char *name, const float *plane, size_t count) {
    double least = INFINITY, most = -INFINITY, sum = 0.0;
    size_t finite = 0;
    for (size_t i = 0; i < count; ++i) {
        if (isfinite(plane[i])) {
            const double value = plane[i];
            least = value < least ? value : least;
            most = value > most ? value : most;
            sum += value;
            ++finite;
        }
    }
    if (finite > 0) {
        printf("channel '%s': min %.6g, mean %.6g, max %.6g\n", name, least, sum / (double)finite, most);
    } else {
        printf("channel '%s': no finite value\n", name);
    }
    if (finite < count) {
        printf("  problem: %zu values are not finite\n", count - finite);
    }
}

int cli_info_image(const char *path, const vsh_run *run) {
    vsh_image_file *file = NULL;
    vsh_error error;
    if (vsh_image_read(path, run, &file, &error) != VSH_OK) {
        return cli_fail(&error);
    }
    const vsh_image image = vsh_image_view(file);
    printf("image: %d × %d, %d channels\n", image.width, image.height, image.channel_count);
    for (int32_t i = 0; i < image.channel_count; ++i) {
        print_channel(image.names[i], image.planes[i], (size_t)image.width * (size_t)image.height);
    }
    size_t count = 0;
    const vsh_attribute *attributes = vsh_image_attributes(file, &count);
    for (size_t i = 0; i < count; ++i) {
        printf("%s: %s\n", attributes[i].name, attributes[i].value);
    }
    vsh_image_free(file);
    return CLI_OK;
}
