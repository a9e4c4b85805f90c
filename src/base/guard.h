// The one guard at the border between C and C++: every exception becomes a vsh_error, and the host's
// floating-point environment is kept out.
#pragma once

#include "base/error.h"
#include "base/floats.h"

#include <exception>
#include <new>
#include <stdexcept>
#include <type_traits>

namespace vshi {

// Thrown inside the shims to leave with an error of our own.
struct Failure {
    vsh_error error{};
};

// Calls a C function, and throws its error if it fails. The error is its last parameter, which callers here
// leave out.
template <typename Function, typename... Arguments>
void require(Function *function, const Arguments &...arguments) {
    Failure failure;
    if (function(arguments..., &failure.error) != VSH_OK) {
        throw failure;
    }
}

// Returns the result of body(), or VSH_OK where it returns nothing. Exceptions become VSH_ERROR_MEMORY or
// `code`, prefixed by `what`.
template <typename Body>
vsh_result guard(vsh_error *error, vsh_result code, const char *what, Body &&body) noexcept {
    VSHI_FLOATS;
    try {
        if constexpr (std::is_void_v<decltype(body())>) {
            body();
            return VSH_OK;
        } else {
            return body();
        }
    } catch (const Failure &failure) {
        return vshi_fail(error, failure.error.code, "%s", failure.error.message);
    } catch (const std::bad_alloc &) {
        return vshi_fail(error, VSH_ERROR_MEMORY, "%s: the system refused memory", what);
    } catch (const std::exception &exception) {
        return vshi_fail(error, code, "%s: %s", what, exception.what());
    } catch (...) {
        return vshi_fail(error, VSH_ERROR_INTERNAL, "%s: unknown exception", what);
    }
}

} // namespace vshi
