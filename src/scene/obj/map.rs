//! Statements of MTL that name a texture: `map_Kd -s 2 2 -o 0.5 wood.png`.

use crate::scene::obj::statement::Statement;
use crate::scene::texel_channels::{Channel, Part};
use crate::scene::texture::{Texture, TextureImage, Wrap};

/// Largest number of an option.
const MOST: f64 = 1e15;

/// What a texture is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum MapKind {
    Diffuse,
    Specular,
    Exponent,
    Opacity,
    Emission,
    /// Heights, or, misused, normals.
    Bump,
    Normal,
    Roughness,
    Metallic,
    Sheen,
    Coat,
    CoatRoughness,
}

impl MapKind {
    /// By a keyword in lower case.
    pub fn of(keyword: &[u8]) -> Option<Self> {
        Some(match keyword {
            b"map_kd" => Self::Diffuse,
            b"map_ks" => Self::Specular,
            b"map_ns" => Self::Exponent,
            b"map_d" => Self::Opacity,
            b"map_ke" => Self::Emission,
            b"map_bump" | b"bump" => Self::Bump,
            b"norm" | b"map_kn" | b"map_norm" => Self::Normal,
            b"map_pr" => Self::Roughness,
            b"map_pm" => Self::Metallic,
            b"map_ps" => Self::Sheen,
            b"map_pc" => Self::Coat,
            b"map_pcr" => Self::CoatRoughness,
            _ => return None,
        })
    }
}

/// A statement that names a texture.
#[derive(Debug, Clone)]
pub(super) struct Map {
    /// As it is written, quoted.
    pub keyword: String,
    /// Of the file, as it is written.
    pub name: String,
    /// `-s` and `-o`: coordinates of the texture are scale · coordinates + offset.
    scale: [f64; 2],
    offset: [f64; 2],
    /// `-clamp`.
    clamp: bool,
    /// `-bm`.
    pub bump: f64,
    /// `-imfchan`.
    pub channel: Option<Channel>,
    /// `-mm`: values become base + gain · value.
    base: f64,
    gain: f64,
}

impl Map {
    /// Reads the options and the name. `problems` is told of options that have no effect here.
    pub fn read(statement: &Statement<'_>, problems: &mut Vec<String>) -> Self {
        let text = statement.name();
        let mut map = Self {
            keyword: statement.quoted_keyword(),
            name: String::new(),
            scale: [1.0; 2],
            offset: [0.0; 2],
            clamp: false,
            bump: 1.0,
            channel: None,
            base: 0.0,
            gain: 1.0,
        };
        let mut rest = text.as_str();
        while let Some(after) = map.read_option(rest, problems) {
            rest = after;
        }
        map.name = rest.to_owned();
        map
    }

    /// Reads the option that a text begins with, and returns what follows it.
    fn read_option<'a>(&mut self, text: &'a str, problems: &mut Vec<String>) -> Option<&'a str> {
        let (word, after) = split_word(text);
        let option = word.to_ascii_lowercase();
        let mut rest = after;
        let mut unsupported = |what: &str| problems.push(format!("the option {word} of {} {what}", self.keyword));
        match option.as_str() {
            "-s" | "-o" | "-t" => {
                let numbers = take_numbers(&mut rest, 3);
                let target = match option.as_str() {
                    "-s" => &mut self.scale,
                    "-o" => &mut self.offset,
                    _ => {
                        unsupported("is not supported and is ignored");
                        return Some(rest);
                    }
                };
                target.iter_mut().zip(numbers).for_each(|(to, number)| *to = number);
            }
            "-mm" => {
                let numbers = take_numbers(&mut rest, 2);
                self.base = numbers.first().copied().unwrap_or(0.0);
                self.gain = numbers.get(1).copied().unwrap_or(1.0);
            }
            "-bm" => self.bump = take_numbers(&mut rest, 1).first().copied().unwrap_or(1.0),
            // How a texture is filtered.
            "-boost" | "-texres" => drop(take_numbers(&mut rest, 1)),
            "-clamp" | "-blendu" | "-blendv" | "-cc" => {
                let value;
                (value, rest) = split_word(after);
                if option == "-clamp" {
                    self.clamp = value.eq_ignore_ascii_case("on");
                }
            }
            "-imfchan" => {
                let value;
                (value, rest) = split_word(after);
                self.channel = match value.to_ascii_lowercase().as_str() {
                    "r" => Some(Channel::Red),
                    "g" => Some(Channel::Green),
                    "b" => Some(Channel::Blue),
                    "m" => Some(Channel::Alpha),
                    "l" => Some(Channel::Luminance),
                    _ => {
                        unsupported(&format!("is {value:?}, expected r, g, b, m or l: it is ignored"));
                        None
                    }
                };
            }
            "-type" => {
                (_, rest) = split_word(after);
                unsupported("is not supported and is ignored");
            }
            _ => return None,
        }
        Some(rest)
    }

    /// How an image is looked up. (v of OBJ runs up, from the lower edge of the image.)
    pub fn texture(&self, image: u32, srgb: bool) -> Texture {
        let ([su, sv], [ou, ov]) = (self.scale, self.offset);
        let wrap = if self.clamp { Wrap::Clamp } else { Wrap::Repeat };
        Texture { wrap: [wrap; 2], transform: [[su, 0.0, ou], [0.0, sv, 1.0 - sv - ov]], ..Texture::new(image, srgb) }
    }

    /// Whether both look up their images alike.
    pub fn is_placed_as(&self, other: &Self) -> bool {
        self.texture(0, false) == other.texture(0, false)
    }

    /// Whether values are taken as they are.
    pub fn is_plain(&self) -> bool {
        self.base == 0.0 && self.gain == 1.0
    }

    /// A channel of an image, after `-mm`.
    pub fn part<'a>(&self, image: &'a TextureImage, channel: Channel) -> Part<'a> {
        let (base, gain) = (self.base, self.gain);
        let change = (!self.is_plain()).then(|| Box::new(move |x| base + gain * x) as _);
        Part { change, ..Part::plain(image, channel) }
    }

    /// The channel that numbers are in.
    pub fn numbers(&self) -> Channel {
        self.channel.unwrap_or(Channel::Luminance)
    }

    /// Names what is taken of an image.
    pub fn levels(&self, channel: Channel) -> String {
        if self.is_plain() { format!("{channel:?}") } else { format!("{channel:?}·{} + {}", self.gain, self.base) }
    }
}

/// The first word of a text, and what follows it.
fn split_word(text: &str) -> (&str, &str) {
    let text = text.trim_start();
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    (&text[..end], text[end..].trim_start())
}

/// Takes numbers from the beginning of a text, at most so many; the last word is a name.
fn take_numbers(rest: &mut &str, most: usize) -> Vec<f64> {
    let mut numbers = Vec::new();
    while numbers.len() < most {
        let (word, after) = split_word(rest);
        let number = word.parse().ok().filter(|x: &f64| x.abs() <= MOST);
        let Some(number) = number.filter(|_| !after.is_empty()) else { break };
        numbers.push(number);
        *rest = after;
    }
    numbers
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::obj::statement::statements;

    fn read(text: &str) -> (Map, Vec<String>) {
        let mut problems = Vec::new();
        let line = format!("map_Kd {text}");
        let statement = statements(line.as_bytes()).next().unwrap();
        (Map::read(&statement, &mut problems), problems)
    }

    #[test]
    fn options_and_names() {
        for (text, name) in [
            ("a.png", "a.png"),
            ("my wood.png", "my wood.png"),
            ("-s 2 3 1 -o .5 my wood.png", "my wood.png"),
            ("-s 2 7.png", "7.png"),
            ("-clamp on -blendu off -blendv on -cc on -boost 2 -texres 512 -bm 0.5 -mm 0 1 a.png", "a.png"),
            ("-odd name.png", "-odd name.png"),
            ("-imfchan R 'a b.png' # c", "'a b.png' # c"),
            ("", ""),
            ("-s", ""),
            ("-bm 2", "2"),
        ] {
            let (map, problems) = read(text);
            assert_eq!((map.name.as_str(), problems.len()), (name, 0), "{text}");
        }
        let (map, _) = read("-s 2 3 1 -o .5 -clamp on -bm 4 -mm .25 .5 -imfchan g x.png");
        assert_eq!((map.scale, map.offset, map.clamp, map.bump), ([2.0, 3.0], [0.5, 0.0], true, 4.0));
        assert_eq!((map.channel, map.base + map.gain), (Some(Channel::Green), 0.75));
        // (u, v) of the file is (u, 1 − v) of the mesh; 3v + 0 up is this far down.
        let texture = map.texture(0, false);
        let [u, v] = texture.transform.map(|[a, b, c]| a * 0.25 + b * (1.0 - 0.3) + c);
        assert!((u - 1.0).abs() < 1e-15 && (v - (1.0 - 0.9)).abs() < 1e-15, "{u} {v}");
        for (text, word) in
            [("-t 1 1 1 a.png", "-t"), ("-type sphere a.png", "-type"), ("-imfchan z a.png", "-imfchan")]
        {
            let (map, problems) = read(text);
            assert_eq!(map.name, "a.png");
            assert!(matches!(&problems[..], [problem] if problem.contains(word)), "{problems:?}");
        }
    }
}
