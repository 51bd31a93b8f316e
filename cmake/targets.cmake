# Shared build rules: warnings, optimisation, and one function per kind of target.
add_library(coral_warnings INTERFACE)
add_library(coral::warnings ALIAS coral_warnings)
# GCC 12 warns of std::string operator+ without reason (GCC bug 105651); with a precompiled header it shows under four names.
target_compile_options(coral_warnings INTERFACE -Wall -Wextra -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wno-restrict -Wno-stringop-overflow -Wno-stringop-overread -Wno-array-bounds
                                                $<$<BOOL:${CORAL_WERROR}>:-Werror>)

# errno and floating-point traps are never read; without them loops vectorise. Results keep IEEE rules otherwise.
add_compile_options(-fno-math-errno -fno-trapping-math)
if(CORAL_NATIVE)
    add_compile_options(-march=native)
    # Never wider than AVX2, but for modules that ask for it with CORAL_PROCESSOR_HAS_AVX512: with AVX-512 Eigen would sum in another order than on other processors, and GCC 12's header warns of its own
    # variables (GCC bug 105593).
    include(CheckCXXCompilerFlag)
    include(CheckCXXSourceCompiles)
    set(CMAKE_REQUIRED_FLAGS -march=native)
    check_cxx_source_compiles("#if !defined(__AVX512F__) || !defined(__AVX512DQ__) || !defined(__AVX512VL__)
        #error
        #endif
        int main() {}" CORAL_PROCESSOR_HAS_AVX512)
    unset(CMAKE_REQUIRED_FLAGS)
    check_cxx_compiler_flag(-mno-avx512f CORAL_COMPILER_KNOWS_AVX512)
    if(CORAL_COMPILER_KNOWS_AVX512)
        add_compile_options(-mno-avx512f)
    endif()
endif()
# Mains, options and summaries are never hot: a fifth less time to compile.
set(CORAL_COLD $<$<CONFIG:Release>:-O1>)
if(CORAL_SANITIZE)
    add_compile_options(-fsanitize=${CORAL_SANITIZE} -fno-omit-frame-pointer)
    add_link_options(-fsanitize=${CORAL_SANITIZE})
endif()

# Eigen and the standard library are most of what a small file compiles: parsed once, for the modules and for the tests.
# CGAL's -frounding-math and a sanitizer's flags are theirs alone: where flags differ GCC ignores the header and says so.
function(coral_precompiled name)
    cmake_parse_arguments(arg "" "" "HEADERS;LIBS;OPTIONS" ${ARGN})
    file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/${name}.cpp CONTENT "")
    add_library(${name} STATIC ${PROJECT_BINARY_DIR}/${name}.cpp)
    target_link_libraries(${name} PRIVATE Eigen3::Eigen ${arg_LIBS} coral::warnings)
    target_compile_options(${name} PRIVATE ${arg_OPTIONS})
    target_precompile_headers(${name} PRIVATE <Eigen/Core> <Eigen/Geometry> <algorithm> <array> <cmath> <cstdint> <filesystem>
        <functional> <map> <memory> <mutex> <optional> <span> <string> <unordered_map> <vector> ${arg_HEADERS})
endfunction()
coral_precompiled(coral_precompiled_lib)

# coral_module(<name> SOURCES a.cpp ... PUBLIC libs... PRIVATE libs... [OPTIONS flags...]): library coral::<name> of lib/<name>/.
function(coral_module name)
    cmake_parse_arguments(arg "" "" "SOURCES;PUBLIC;PRIVATE;OPTIONS" ${ARGN})
    add_library(coral_${name} STATIC ${arg_SOURCES})
    add_library(coral::${name} ALIAS coral_${name})
    target_include_directories(coral_${name} PUBLIC ${PROJECT_SOURCE_DIR}/lib)
    target_link_libraries(coral_${name} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE} coral::warnings)
    if(arg_OPTIONS)
        coral_precompiled(coral_precompiled_${name} OPTIONS ${arg_OPTIONS})
        target_compile_options(coral_${name} PRIVATE ${arg_OPTIONS})
        target_precompile_headers(coral_${name} REUSE_FROM coral_precompiled_${name})
    else()
        target_precompile_headers(coral_${name} REUSE_FROM coral_precompiled_lib)
    endif()
endfunction()

# coral_tool(<name> libs...): program build/<preset>/bin/<name> from tools/<name>.cpp, with its three standard tests.
function(coral_tool name)
    add_executable(${name} ${name}.cpp)
    target_link_libraries(${name} PRIVATE coral::cli ${ARGN} coral::warnings)
    target_compile_options(${name} PRIVATE ${CORAL_COLD})
    target_precompile_headers(${name} REUSE_FROM coral_cli)
    install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
    set_property(GLOBAL APPEND PROPERTY CORAL_TOOLS ${name})
endfunction()

if(CORAL_TESTS)
    coral_precompiled(coral_precompiled_test HEADERS <gtest/gtest.h> LIBS GTest::gtest)
endif()

# coral_test(<name> SOURCES a_test.cpp ... LIBS libs...): one GoogleTest program per module, found test by test by ctest.
function(coral_test name)
    cmake_parse_arguments(arg "" "" "SOURCES;LIBS" ${ARGN})
    add_executable(test_${name} ${arg_SOURCES})
    target_include_directories(test_${name} PRIVATE ${PROJECT_SOURCE_DIR}/tests)
    target_link_libraries(test_${name} PRIVATE ${arg_LIBS} GTest::gtest_main coral::warnings)
    target_compile_definitions(test_${name} PRIVATE
        CORAL_SOURCE_DIR="${PROJECT_SOURCE_DIR}" CORAL_BIN_DIR="${CMAKE_RUNTIME_OUTPUT_DIRECTORY}")
    target_precompile_headers(test_${name} REUSE_FROM coral_precompiled_test)
    include(GoogleTest)
    gtest_discover_tests(test_${name} DISCOVERY_MODE PRE_TEST PROPERTIES LABELS ${name})
endfunction()
