# How shaderc is compiled. Its crate builds all of it, with SPIRV-Tools and glslang, and takes no options; but CMake reads a toolchain
# file, and config.toml names this one. build.rs only translates GLSL, without optimising: the optimiser and the validator are
# left out, which are most of the time. What is left is compiled quickly rather than made quick, since build.rs runs it for
# seconds. The SPIR-V is the same, byte for byte.

set(SHADERC_SKIP_EXAMPLES ON)
set(SHADERC_SKIP_COPYRIGHT_CHECK ON)
set(SKIP_SPIRV_TOOLS_INSTALL ON)
set(ENABLE_OPT OFF)
set(CMAKE_CXX_FLAGS_RELEASE "-O1 -DNDEBUG")
set(REPLACEMENTS ${CMAKE_CURRENT_LIST_DIR})

# Called when all targets are known. A target that another version lacks is no error: it only takes longer then.
function(spare_what_is_not_used)
    foreach(target SPIRV-Tools-shared SPIRV-Tools-reduce SPIRV-Tools-link SPIRV-Tools-lint SPIRV-Tools-diff)
        if(TARGET ${target})
            set_target_properties(${target} PROPERTIES EXCLUDE_FROM_ALL TRUE)
        endif()
    endforeach()
    replace(SPIRV-Tools-opt "." no_optimizer.cpp)
    replace(SPIRV-Tools-static "/val/" no_validator.cpp)
endfunction()

# The sources of `target` whose paths match `pattern` by one of this folder.
function(replace target pattern source)
    if(TARGET ${target})
        get_target_property(sources ${target} SOURCES)
        list(FILTER sources EXCLUDE REGEX "${pattern}")
        set_target_properties(${target} PROPERTIES SOURCES "${sources};${REPLACEMENTS}/${source}")
    endif()
endfunction()

# A toolchain is read several times, also for trials of the compiler, where none of these targets is known.
include_guard(GLOBAL)
cmake_language(DEFER DIRECTORY ${CMAKE_SOURCE_DIR} CALL spare_what_is_not_used)
