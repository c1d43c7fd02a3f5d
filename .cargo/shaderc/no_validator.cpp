// Takes the place of SPIRV-Tools' validator in shaderc, see toolchain.cmake. Only its optimiser would call it. What is
// compiled here is validated by the layers that the tests run under.

#include "spirv-tools/libspirv.h"

spv_result_t spvValidateBinary(const spv_const_context, const uint32_t*, const size_t, spv_diagnostic*) {
    return SPV_UNSUPPORTED;
}

spv_result_t spvValidateWithOptions(const spv_const_context, const spv_const_validator_options, const spv_const_binary,
                                    spv_diagnostic*) {
    return SPV_UNSUPPORTED;
}
