"""Reader of the text that scene.h writes: a header of named numbers, then a row of numbers a body."""


def read_scene(file):
    header, rows = {}, []
    with open(file) as lines:
        for line in lines:
            words = line.lstrip("# ").split()
            if line.startswith("#"):
                header[words[0]] = [float(word) for word in words[1:]]
            else:
                rows.append([float(word) for word in words])
    return header, rows
