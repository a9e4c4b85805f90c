/* Files of spheres, and casters made from them. */
#include "fuzz.h"

#include "shapes/spheres.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const char *path = fuzz_file("a.csv", data, size);
    const vsh_run run = fuzz_run();
    double *list;
    size_t count;
    if (FUZZ_MAKE(list, vshi_spheres_read(path, &run, &list, &count, fuzz_error())) == VSH_OK) {
        FUZZ_TRY(vshi_spheres, spheres, vshi_spheres_create(list, count, NULL, &run, &spheres, fuzz_error()));
    }
    free(list);
    return 0;
}
