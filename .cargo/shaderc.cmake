# How shaderc is compiled. Its crate builds all of it, with SPIRV-Tools and glslang, and takes no options; but CMake reads a toolchain
# file, and config.toml names this one. Left out is what compiling shaders does not need; headers that most of SPIRV-Tools includes are
# parsed once; and optimising less saves minutes, where build.rs then runs shaderc for two seconds. It takes a third of the time, and
# the SPIR-V is the same, byte for byte.

set(SHADERC_SKIP_EXAMPLES ON)
set(SHADERC_SKIP_COPYRIGHT_CHECK ON)
set(SKIP_SPIRV_TOOLS_INSTALL ON)
set(CMAKE_CXX_FLAGS_RELEASE "-O1 -DNDEBUG")

# Called when all targets are known. A target or header that another version lacks is no error: it only takes longer then.
function(spare_what_is_not_used)
    foreach(target SPIRV-Tools-shared SPIRV-Tools-reduce SPIRV-Tools-link SPIRV-Tools-lint SPIRV-Tools-diff)
        if(TARGET ${target})
            set_target_properties(${target} PROPERTIES EXCLUDE_FROM_ALL TRUE)
        endif()
    endforeach()
    precompile(SPIRV-Tools-opt ir_context.h pass.h)
    precompile(SPIRV-Tools-static val/validation_state.h)
endfunction()

function(precompile target)
    if(NOT TARGET ${target})
        return()
    endif()
    get_target_property(folder ${target} SOURCE_DIR)
    foreach(header ${ARGN})
        if(EXISTS ${folder}/${header})
            target_precompile_headers(${target} PRIVATE ${folder}/${header})
        endif()
    endforeach()
endfunction()

# A toolchain is read several times, also for trials of the compiler, where none of these targets is known.
include_guard(GLOBAL)
cmake_language(DEFER DIRECTORY ${CMAKE_SOURCE_DIR} CALL spare_what_is_not_used)
