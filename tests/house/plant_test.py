"""scripts/plant.py: which faults it plants in which languages, and that comments and strings stay."""
import importlib.util
import os
import pathlib
import unittest

ROOT = pathlib.Path(os.environ.get("MODAR_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
spec = importlib.util.spec_from_file_location("plant", ROOT / "scripts/plant.py")
plant = importlib.util.module_from_spec(spec)
spec.loader.exec_module(plant)


class Plant(unittest.TestCase):
    def lines(self, text, suffix=".cpp"):
        """What each fault makes of the text, without the lines that stay."""
        made = {}
        for kind, *fault in plant.faults(text, suffix):
            before, after = text.split("\n"), plant.planted(text, fault).split("\n")
            self.assertEqual(len(before), len(after))
            made.setdefault(kind, []).append("; ".join(new.strip() for old, new in zip(before, after) if old != new))
        return made

    def test_each_kind(self):
        made = self.lines("void f(int a) {\n  if (a < 3) call(a, b);\n  total += a - 0.5f;\n}\n")
        self.assertEqual(made["comparison"], ["if (a <= 3) call(a, b);"])
        self.assertEqual(made["swapped"], ["if (a < 3) call(b, a);"])
        self.assertIn(made["constant"][0], ("if (a < 6) call(a, b);", "if (a < 1) call(a, b);"))
        self.assertIn(made["constant"][1], ("total += a - 1.0f;", "total += a - 0.25f;"))
        self.assertEqual(made["sign"], ["total += a + 0.5f;"])
        self.assertEqual(made["dropped"], [""])
        self.assertEqual(made["early return"], ["void f(int a) { if (true) return;"])

    def test_other_languages(self):
        made = self.lines("export function f(a) {\n  if (a === 2) this.go(a);\n}\n", ".js")
        self.assertEqual(made["comparison"], ["if (a !== 2) this.go(a);"])
        self.assertEqual(made["early return"], ["export function f(a) { if (true) return;"])
        made = self.lines("    boolean holds(int a) {\n        seen.add(a);\n        return a >= 4;\n", ".java")
        self.assertEqual(made["comparison"], ["return a > 4;"])
        self.assertEqual(made["dropped"], [""])
        self.assertEqual(made["early return"], ["boolean holds(int a) { if (true) return false;"])

    def test_what_stays(self):
        for text in ("// a < 3\n", "/* b == 4 */\n", 'x("a < 3 + b");\n', "#if A < 3\n", "static_assert(a < 3 + b);\n",
                     "std::vector<int> a;\n", "a <<= b;\n", "auto f = a->b;\n", "x[2];\n", "f(0);\n", "f(a, a);\n"):
            self.assertEqual(self.lines(text), {}, text)

    def test_a_seed_chooses_the_same_places(self):
        def first(seed):
            source = plant.chosen("bake/mesh/weld", seed)
            return [next(source) for _ in range(12)]
        self.assertEqual(first(1), first(1))
        self.assertNotEqual(first(1), first(2))
        self.assertEqual({kind for kind, _ in first(1)}, {"comparison", "constant", "dropped", "early return", "sign", "swapped"})

    def test_rooms_share_the_faults_by_their_lines(self):
        share = plant.shares(list(plant.TESTS), 300)
        self.assertEqual((sum(share.values()), min(share.values())), (300, 4))
        self.assertGreater(share["bake/mesh"], share["bake/pattern"])
        self.assertEqual(plant.room_of("formats/transport/packed.cpp"), "formats/transport")
        self.assertFalse([name for name in plant.sources("formats") if name.startswith("formats/transport/")])

    def test_each_room_has_tests(self):
        self.assertEqual(plant.tests_of("bake/mesh/weld"), plant.TESTS["bake/mesh"])
        for room in plant.TESTS:
            self.assertTrue((ROOT / room).is_dir(), room)


if __name__ == "__main__":
    unittest.main()
